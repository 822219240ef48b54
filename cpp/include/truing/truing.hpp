// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Everything that truing offers to C++.
#pragma once

#include "truing/compensate.hpp"
#include "truing/diagnose.hpp"
#include "truing/dynamics/diagnose.hpp"
#include "truing/dynamics/effect.hpp"
#include "truing/dynamics/identify.hpp"
#include "truing/dynamics/recording.hpp"
#include "truing/dynamics/regressor.hpp"
#include "truing/dynamics/rigid.hpp"
#include "truing/handeye.hpp"
#include "truing/identify.hpp"
#include "truing/inverse.hpp"
#include "truing/model/effect.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"
#include "truing/model/scene.hpp"
#include "truing/model/urdf.hpp"
#include "truing/plan.hpp"
#include "truing/review.hpp"
#include "truing/tracking/calibrate.hpp"
#include "truing/tracking/replay.hpp"
#include "truing/tracking/simulation.hpp"
#include "truing/tracking/streams.hpp"
#include "truing/tracking/tracker.hpp"
#include "truing/version.hpp"
