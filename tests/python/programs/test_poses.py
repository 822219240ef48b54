# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs where tables of poses or joints are taken: ik, compensate, hand-eye, predict, and --poses-out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truing
from program_corpus import CORPUS
from program_robots import nominal
from program_texts import from_euler
from truing import InputError, InputWarning
from truing.files.other_poses import read_other_poses
from truing.files.program_poses import is_program
from truing.model import Target


def test_ik_takes_a_program_of_poses_and_joints() -> None:
    """What the program wants is where the joints of its table bring the tool."""
    robot = nominal("kuka").replace(targets=[Target("other", np.diag([1.0, 1, 1, 1]))])
    with pytest.warns(InputWarning, match="a relative move"):
        data = truing.load_targets(CORPUS / "kuka_inline.src", robot)
    assert data.count == 4 and data.joints is None
    found = truing.inverse(robot, data, seeds=np.radians([0, -80, 95, 0, 45, 10]))
    assert all(found.reached)
    # The flange of the second move, from its numbers in KUKA's order: base * pose * tool^-1.
    base, pose, tool = (
        (600, -200, 100, 20, 0, 0),
        (218.715, 147.321, 458.168, 0, 60, 180),
        (30, 0, 120, 0, 30, 0),
    )
    wanted = from_euler(base) @ from_euler(pose) @ np.linalg.inv(from_euler(tool))
    assert np.allclose(data.tasks[1].T_measurement_target, wanted, atol=1e-12)


def test_the_flange_of_a_urdf_is_its_tip_link() -> None:
    """As `apply` has it. URDFs of arms end in a fixed joint, which is no joint of the robot."""
    arm = nominal("kuka")
    believed = arm.replace(
        joints=arm.joints[:-1], targets=[Target("tool0", np.asarray(arm.joints[-1].T_parent_joint))]
    )
    wanted = []
    for robot in (arm, believed):
        with pytest.warns(InputWarning, match="a relative move"):
            data = truing.load_targets(CORPUS / "kuka_inline.src", robot)
        wanted.append([task.T_measurement_target for task in data.tasks])
    assert np.allclose(wanted[0], wanted[1], atol=1e-12)


def test_a_tool_that_is_not_known_is_the_robots_own() -> None:
    robot = nominal("fanuc")
    with pytest.warns(InputWarning, match="tool is not known: taken to be"):
        data = truing.load_targets(CORPUS / "fanuc_plain.ls", robot)
    assert np.allclose(data.tasks[1].T_measurement_target[:3, 3], [0.818715, 0.147321, 0.658168])


def test_compensate_takes_a_program_of_joints(tmp_path: Path) -> None:
    path = tmp_path / "joints.ls"
    q = [10.0, 12.0, -15.0, 5.0, -60.0, 20.0]
    values = ", ".join(f"J{k + 1}= {a:.3f} deg" for k, a in enumerate(q))
    path.write_text(
        f"/PROG J\n/MN\n 1:J P[1] 50% FINE ;\n/POS\nP[1]{{\n GP1:\n UF : 0, UT : 1,\n {values}\n}};\n/END\n"
    )
    data = truing.load_targets(path, nominal("fanuc"), program=True)
    assert data.is_program and data.joints is not None
    # The pendant counts J3 from the horizon, the model from the lower arm.
    assert np.allclose(np.degrees(data.joints), [[10.0, 12.0, -3.0, 5.0, -60.0, 20.0]])
    assert (
        truing.predict(nominal("fanuc"), truing.load_measurements(path, nominal("fanuc"), joints_only=True))
        is not None
    )


def test_hand_eye_takes_poses_of_the_flange(tmp_path: Path) -> None:
    with pytest.warns(InputWarning, match="its tool is not known"):
        poses = read_other_poses(CORPUS / "yaskawa_arc.jbi")
    assert poses is not None and poses.hand is not None
    assert np.allclose(poses.hand[0, :3, 3], [0.8, -0.1, 0.65])
    point = "p[0.65,-0.4,0.45,0,3.14159265358979,0]"
    script = tmp_path / "two.script"
    script.write_text(f"set_tcp(p[0,0,0.1,0,0,0])\nmovel({point})\nmovel({point})\n")
    poses = read_other_poses(script)
    assert poses is not None and poses.hand is not None and len(poses.hand) == 2
    down = poses.hand[0] @ np.array([0, 0, 0.1, 1])  # set_tcp is 100 mm along the flange's z
    assert np.allclose(down[:3], [0.65, -0.4, 0.45])


def test_a_move_whose_hand_pose_is_not_known_shifts_no_rows() -> None:
    with pytest.raises(InputError, match="line 14.*not known which row belongs to it"):
        read_other_poses(CORPUS / "ur_waypoints.script")


def test_joints_are_no_hand_poses() -> None:
    with pytest.raises(InputError, match=r"line 4: .* given by joints"):
        read_other_poses(CORPUS / "kuka_arc.src")


def test_nothing_is_measured_in_a_program() -> None:
    with pytest.raises(InputError, match="nothing is measured"):
        truing.load_measurements(CORPUS / "fanuc_plain.ls", nominal("fanuc"))


def test_a_table_called_dat_is_no_program(tmp_path: Path) -> None:
    (tmp_path / "poses.dat").write_text("1 2 3\n")
    assert not is_program(tmp_path / "poses.dat")
    assert is_program(CORPUS / "kuka_points.dat")
