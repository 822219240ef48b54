# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The names of the package itself: their only list. ``truing`` loads it when one of them is first asked for.

Every user needs what is here: verbs, readers and writers, robots, measurements, errors. Options that only one
verb takes, and what it returns, are in that verb's room.
"""

from truing import (
    common as common,
    controllers as controllers,
    diagnosis as diagnosis,
    dynamics as dynamics,
    examples as examples,
    files as files,
    fleet as fleet,
    hand_eye as hand_eye,
    identification as identification,
    inverse_kinematics as inverse_kinematics,
    model as model,
    performance as performance,
    planning as planning,
    programs as programs,
    testing as testing,
    tracking as tracking,
)
from truing.diagnosis import diagnose as diagnose
from truing.effects import Effect as Effect
from truing.errors import (
    InputError as InputError,
    InputWarning as InputWarning,
    NotConvergedError as NotConvergedError,
    UndecidedError as UndecidedError,
)
from truing.files import (
    load_camera as load_camera,
    load_handeye as load_handeye,
    load_imu as load_imu,
    load_joints as load_joints,
    load_measurements as load_measurements,
    load_plan as load_plan,
    load_robot as load_robot,
    load_scene as load_scene,
    load_setup as load_setup,
    load_targets as load_targets,
    load_tool_poses as load_tool_poses,
    load_tracker as load_tracker,
    load_uncertainty as load_uncertainty,
    save_camera as save_camera,
    save_measurements as save_measurements,
    save_robot as save_robot,
    save_setup as save_setup,
)
from truing.fleet import Gram as Gram
from truing.hand_eye import handeye as handeye
from truing.identification import (
    identify as identify,
    predict as predict,
    residuals as residuals,
    review as review,
)
from truing.inverse_kinematics import (
    compensate as compensate,
    inverse as inverse,
    inverse_path as inverse_path,
)
from truing.model import (
    Joint as Joint,
    Measurements as Measurements,
    Robot as Robot,
    Target as Target,
    forward_kinematics as forward_kinematics,
    frame_from_xyz_rpy as frame_from_xyz_rpy,
)
from truing.planning import (
    distinguish as distinguish,
    plan as plan,
)
from truing.testing import simulate as simulate
from truing.tracking import (
    recorded_streams as recorded_streams,
    replay as replay,
    track_calibrate as track_calibrate,
)
