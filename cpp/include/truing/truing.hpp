// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Everything that truing offers to C++.
#pragma once

#include "truing/compensate.hpp"
#include "truing/diagnose.hpp"
#include "truing/effect.hpp"
#include "truing/handeye.hpp"
#include "truing/identify.hpp"
#include "truing/interference.hpp"
#include "truing/inverse.hpp"
#include "truing/measurement.hpp"
#include "truing/plan.hpp"
#include "truing/robot.hpp"
#include "truing/stream_simulation.hpp"
#include "truing/streams.hpp"
#include "truing/track.hpp"
#include "truing/track_calibrate.hpp"
#include "truing/track_replay.hpp"
#include "truing/urdf.hpp"
#include "truing/version.hpp"
