// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Motion, torques and what lies between them and the model.
#pragma once

#include "truing/dynamics/diagnose.hpp"
#include "truing/dynamics/effect.hpp"
#include "truing/dynamics/identify.hpp"
#include "truing/dynamics/plan.hpp"
#include "truing/dynamics/recording.hpp"
#include "truing/dynamics/regressor.hpp"
#include "truing/dynamics/rigid.hpp"
#include "truing/dynamics/sums.hpp"
