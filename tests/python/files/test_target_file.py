# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Target files, scenes and uncertainties: read as they are meant, or refused in one line that says where and
what to do.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

import truing
from fuzzing import mutated, quick
from inverse_arms import gantry, irb, poses_of, random_joints
from scene_files import NAMES, SCENE
from tables import write
from truing.errors import InputError
from truing.inverse_kinematics import InverseSolver, Task
from truing.rotations import quaternions_from_rotations

ROBOT = irb()
SEEDS = tuple(f"q{k}_rad" for k in range(1, 7))


def poses(count: int = 4) -> dict[str, list[str]]:
    """Columns of a file of poses that the robot reaches."""
    frames = poses_of(InverseSolver(ROBOT), random_joints(ROBOT, count, seed=1, share=0.7))
    values = np.column_stack([frames[:, :3, 3], quaternions_from_rotations(frames[:, :3, :3])])
    return {name: [repr(float(value)) for value in values[:, k]] for k, name in enumerate(NAMES)}


# ---- What is read --------------------------------------------------------------------------------


def test_poses_are_read_as_they_are(tmp_path: Path) -> None:
    frames = poses_of(InverseSolver(ROBOT), random_joints(ROBOT, 4, seed=1, share=0.7))
    data = truing.load_targets(write(tmp_path / "t.csv", poses()), ROBOT)
    assert data.count == 4 and not data.is_program and data.joints is None and data.conditions == ()
    for task, frame in zip(data.tasks, frames, strict=True):
        assert task.kind == "pose" and np.abs(task.T_measurement_target - frame).max() < 1e-15


def test_millimetres_and_degrees_are_converted(tmp_path: Path) -> None:
    columns = poses(2)
    scaled: dict[str, Sequence[object]] = {
        name.replace("_m", "_mm"): [repr(1000 * float(v)) for v in columns[name]] for name in NAMES[:3]
    }
    scaled |= {name: columns[name] for name in NAMES[3:]}
    scaled |= {
        "task": ["torch", "torch"],
        "roll_lower_deg": [-10, -20],
        "roll_upper_deg": [10, ""],
        "roll_deg": [5, ""],
        "lead_lower_deg": [-3, ""],
        "lead_upper_deg": [4, 2],
    }
    scaled |= (
        {f"q{k}_deg": [10 * k, 0] for k in range(1, 7)}
        | {"payload_kg": [1.5, 0]}
        | {f"dir{k}": [1, -1] for k in range(1, 7)}
    )
    data = truing.load_targets(write(tmp_path / "t.csv", scaled), ROBOT)
    first, second = data.tasks
    assert first.T_measurement_target[0, 3] == pytest.approx(float(columns["x_m"][0]), rel=1e-15)
    assert first.roll == pytest.approx((math.radians(-10), math.radians(10))) and second.roll == (
        math.radians(-20),
        math.inf,
    )
    assert first.preferred_roll == pytest.approx(math.radians(5)) and second.preferred_roll is None
    assert (
        first.lead == pytest.approx((math.radians(-3), math.radians(4)))
        and second.lead == pytest.approx((0.0, math.radians(2)))
        and first.work == (0.0, 0.0)
    )
    assert data.joints is not None and data.joints[0] == pytest.approx(np.radians(10 * np.arange(1, 7)))
    assert [c.payload for c in data.conditions] == [1.5, 0.0] and tuple(data.conditions[1].direction) == (
        -1,
    ) * 6


def test_what_rows_do_not_say_the_command_says(tmp_path: Path) -> None:
    columns: dict[str, Sequence[object]] = {**poses(3), "task": ["", "pose", "point"]}
    like = Task(
        np.eye(4), kind="torch", axis=[1, 0, 0], travel=[0, 1, 0], roll=(-0.1, 0.1), longest_retreat=0.05
    )
    tasks = truing.load_targets(write(tmp_path / "t.csv", columns), ROBOT, like=like).tasks
    assert [task.kind for task in tasks] == ["torch", "pose", "point"]
    assert (
        tasks[0].axis.tolist() == [1, 0, 0]
        and tasks[0].roll == (-0.1, 0.1)
        and tasks[2].longest_retreat == 0.05
    )


def test_points_need_no_orientation(tmp_path: Path) -> None:
    columns: dict[str, Sequence[object]] = {
        name: values for name, values in poses(3).items() if name in NAMES[:3]
    }
    data = truing.load_targets(
        write(tmp_path / "t.csv", columns),
        ROBOT,
        like=Task(np.eye(4), kind="point"),
    )
    assert [task.kind for task in data.tasks] == ["point"] * 3
    mixed: dict[str, Sequence[object]] = {**poses(2), "task": ["point", "pose"]}
    mixed |= {name: ["", mixed[name][1]] for name in NAMES[3:]}
    assert truing.load_targets(write(tmp_path / "t.csv", mixed), ROBOT).tasks[0].kind == "point"


def test_a_program_of_joints_is_one_where_it_may_be(tmp_path: Path) -> None:
    path = write(tmp_path / "t.csv", {name: [0.1, 0.2, 0.3] for name in SEEDS} | {"payload_kg": [0, 1, 2]})
    data = truing.load_targets(path, ROBOT, program=True)
    assert (
        data.is_program
        and data.count == 3
        and data.joints is not None
        and data.joints[1].tolist() == [0.2] * 6
        and data.conditions[2].payload == 2.0
    )
    with pytest.raises(InputError, match="there are no targets: expected the columns x_m"):
        truing.load_targets(path, ROBOT)


def test_parquet_is_read_as_well(tmp_path: Path) -> None:
    from truing.files import write_table

    write_table(
        tmp_path / "t.parquet",
        {name: np.array([float(v) for v in values]) for name, values in poses().items()},
    )
    assert truing.load_targets(tmp_path / "t.parquet", ROBOT).count == 4


def test_a_target_that_is_only_out_of_reach_is_read(tmp_path: Path) -> None:
    """Off the rails is an answer of the solver, not an error of the file."""
    columns: dict[str, Sequence[object]] = {**poses(1), "x_m": [11.5], "y_m": [2.0], "z_m": [1.0]}
    robot = gantry()
    data = truing.load_targets(write(tmp_path / "t.csv", columns), robot)
    assert truing.inverse(robot, data).reasons == ("out_of_reach",) or truing.inverse(
        robot, data
    ).reasons == ("limit",)


# ---- Bad targets ---------------------------------------------------------------------------------


def changed(**columns: Sequence[object]) -> dict[str, Sequence[object]]:
    return {**poses(), **columns}


def without(*names: str) -> dict[str, Sequence[object]]:
    return {name: values for name, values in poses().items() if name not in names}


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (
            changed(x_m=["0.3", "nan", "0.3", "0.3"]),
            r"line 3, column 'x_m': found 'nan', expected a finite number",
        ),
        (changed(x_m=["0.3", "inf", "0.3", "0.3"]), r"line 3, column 'x_m': found 'inf'"),
        (changed(x_m=["0.3", "", "0.3", "0.3"]), r"line 3, column 'x_m': found an empty cell"),
        (
            changed(x_m=["0.3", "here", "0.3", "0.3"]),
            r"line 3, column 'x_m': found 'here', expected a number",
        ),
        (changed(qw=[2, 1, 1, 1]), r"line 2: found the quaternion 2 .* expected a unit quaternion"),
        (
            changed(
                **{
                    name: [
                        "1" if name == "qw" else "0",
                        "0",
                        "1" if name == "qw" else "0",
                        "1" if name == "qw" else "0",
                    ]
                    for name in NAMES[3:]
                }
            ),
            r"line 3: found the quaternion 0 0 0 0, of length 0",
        ),
        (changed(qz=["", "0", "0", "0"]), r"line 2, column 'qz': found an empty cell"),
        (without("z_m"), r"there is x_m but no column z_m or z_mm: a position has three"),
        (without("qz"), r"there is qw but no column qz: an orientation is a quaternion"),
        (without(*NAMES[3:]), r"line 2: a pose has an orientation: expected the columns qw, qx, qy, qz"),
        (without(*NAMES[:3]), r"there are no targets: expected the columns x_m"),
        (changed(x=[1] * 4), r"column 'x': no unit, expected x_m or x_mm"),
        (changed(x_inch=[1] * 4), r"column 'x_inch': unknown unit 'inch', expected x_m or x_mm"),
        (changed(x_mm=[1] * 4), r"column 'x_mm': column 'x_m' is there too"),
        (changed(rol_rad=[1] * 4), r"column 'rol_rad': unknown column; did you mean 'roll_rad'"),
        (changed(colour=[1] * 4), r"column 'colour': unknown column; expected x_m"),
        (changed(q1_rad=[0] * 4), r"there is q1_rad but no column q2_rad or q2_deg: 6 driven joints"),
        (
            changed(**{f"q{k}_rad": [0] * 4 for k in range(1, 8)}),
            r"column 'q7_rad': the robot has 6 driven joints: J1",
        ),
        (
            changed(**{f"q{k}_m": [0] * 4 for k in range(1, 7)}),
            r"column 'q1_m': joint 'J1' is revolute, expected q1_rad or q1_deg",
        ),
        (changed(**{name: [45.0, 90.0, -60.0, 80.0] for name in SEEDS}), r"look like degrees"),
        (
            changed(x_m=["300", "310", "290", "305"]),
            r"line 2: x_m, y_m, z_m: this target is 300.* m from the robot's base, .* looks like millimetres",
        ),
        (changed(x_m=["0.3", "0.3", "1e9", "0.3"]), r"line 4: .* is its unit right\?"),
        (
            {name.replace("_m", "_mm"): values for name, values in poses().items()},
            r"x_mm, y_mm, z_mm: all targets are within .* they look like metres",
        ),
        (
            changed(task=["pose", "weld", "pose", "pose"]),
            r"line 3, column 'task': found 'weld', expected pose, torch or point",
        ),
        (
            changed(roll_rad=[0.1] * 4),
            r"line 2, column 'roll_rad': a pose has no roll: that is of the task torch",
        ),
        (
            changed(task=["torch"] * 4, roll_rad=["0.1", "90", "0.1", "0.1"]),
            r"line 3, column 'roll_rad': found 90 rad, .* look like degrees: call the column roll_deg",
        ),
        (
            changed(task=["torch"] * 4, lead_lower_rad=[0.2] * 4, lead_upper_rad=[0.3, 0.1, 0.3, 0.3]),
            r"line 3: the window of lead is empty: its lower end 0.2 rad is above",
        ),
        (
            changed(task=["torch"] * 4, work_upper_rad=[0.2, 4.0, 0.2, 0.2]),
            r"line 3, column 'work_upper_rad': found 4 rad",
        ),
        (
            changed(**{f"dir{k}": [0, 2, 0, 0] for k in range(1, 7)}),
            r"line 3, column 'dir1': found '2', expected -1, 0 or 1",
        ),
        (changed(dir1=[0] * 4), r"there is dir1 but no column dir2"),
        (
            changed(payload_kg=[0, 1, -1, 0]),
            r"line 4, column 'payload_kg': found '-1', expected a mass of zero or more",
        ),
        (changed(payload_lb=[0] * 4), r"column 'payload_lb': unknown unit 'lb', expected payload_kg"),
    ],
)
def test_a_bad_target_file_is_refused_with_the_place(
    tmp_path: Path, columns: Mapping[str, Sequence[object]], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        truing.load_targets(write(tmp_path / "bad.csv", columns), ROBOT)
    assert "bad.csv" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "is empty, expected a table"),
        (",".join(NAMES) + "\n", "has column names but no rows"),
        (";".join(NAMES) + "\n1;2;3;1;0;0;0\n", "separated by semicolons"),
        (",".join(NAMES) + "\n0.3,0,0.5,1,0,0\n", "line 2: found 6 cells, expected 7"),
        ("\x00\x01", "binary"),
    ],
)
def test_what_is_no_table_of_targets_is_refused(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "bad.csv").write_text(content)
    with pytest.raises(InputError, match=message):
        truing.load_targets(tmp_path / "bad.csv", ROBOT)


def test_a_program_with_parts_of_poses_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "t.csv", {name: [0.1] for name in SEEDS} | {"roll_rad": [0.1]})
    with pytest.raises(InputError, match="column 'roll_rad': is about poses, but there are no columns x_m"):
        truing.load_targets(path, ROBOT, program=True)


# ---- Scenes --------------------------------------------------------------------------------------


def test_a_scene_is_read_in_si(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_bytes(SCENE)
    scene = truing.load_scene(tmp_path / "scene.yaml", ROBOT)
    table, post, ball = scene.obstacles
    assert (table.shape, post.shape, ball.shape) == ("box", "capsule", "sphere")
    assert table.size.tolist() == [0.8, 0.4, 0.04] and post.size[2] == 0.9 and ball.radius == 0.08
    assert table.T_measurement_shape == pytest.approx(
        truing.frame_from_xyz_rpy([0.6, 0, -0.02], [0, 0, math.pi / 2])
    )
    assert (
        scene.capsules[0].start == pytest.approx([0, 0, -0.25])
        and scene.clearance == 0.005
        and scene.ignored == (("forearm", "post"),)
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("format: truing-scene/1\n", "", "key 'format' is missing"),
        (
            "truing-scene/1",
            "truing-robot/1",
            "line 1: format: found 'truing-robot/1', expected 'truing-scene/1'",
        ),
        ("units: {length: mm, angle: deg}\n", "", "key 'units' is missing"),
        (
            "shape: sphere",
            "shape: ball",
            r"line 6: obstacles\[2\] \(ball\) shape: found 'ball', expected one of sphere, capsule, box",
        ),
        ("radius: 80", "radius: -80", r"line 6: .* radius: expected more than zero"),
        (", radius: 80", "", r"line 6: .* key 'radius' is missing: a sphere has radius"),
        ("radius: 80", "radius: 80, size: [1, 1, 1]", r"line 6: .* size: a sphere has no size"),
        ("length: 900", "length: nan", "expected a finite number"),
        ("name: ball", "name: post", r"line 6: .* the name 'post' is there twice \(first in line 5\)"),
        (
            "link: J4",
            "link: J9",
            r"line 8: capsules\[0\] \(forearm\) link: there is no link 'J9'; the links are base, J1",
        ),
        ("[[forearm, post]]", "[[forearm, pole]]", r"line 11: ignored\[0\]: there is no 'pole'"),
        ("[[forearm, post]]", "[forearm, post]", "expected a pair of names"),
        ("clearance: 5", "clearance: -5", r"line 10: clearance: found -5, expected zero or more"),
        ("clearance", "clearence", "unknown key; did you mean 'clearance'"),
        ("xyz: [600, 0, -20]", "xyz: [600, 0]", "expected a list of 3 numbers"),
        ("{length: mm, angle: deg}", "{length: inch}", "expected one of m, mm"),
        (
            "xyz: [300, 300, 500]",
            "xyz: [3000000, 300, 500]",
            r"line 6: .* is more than 1000 m: it looks like millimetres",
        ),
    ],
)
def test_a_bad_scene_is_refused_with_its_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = SCENE.decode()
    assert old in text
    (tmp_path / "scene.yaml").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        truing.load_scene(tmp_path / "scene.yaml", ROBOT)
    assert "scene.yaml" in str(caught.value)


# ---- Uncertainty ---------------------------------------------------------------------------------


def write_identification(
    folder: Path,
    names: Sequence[str] = ("J2.a", "J3.d"),
    covariance: str = "name,J2.a,J3.d\nJ2.a,4e-10,1e-10\nJ3.d,1e-10,9e-10\n",
) -> Path:
    parameters = [{"name": name, "value": 0.1, "sigma": 2e-5, "frozen": False} for name in names] + [
        {"name": "J1.d", "value": 0.3, "sigma": None, "frozen": True}
    ]
    (folder / "result.json").write_text(
        json.dumps({"format": "truing-identification/1", "parameters": parameters})
    )
    (folder / "covariance.csv").write_text(covariance)
    return folder / "result.json"


def test_an_uncertainty_is_that_of_the_fitted_parameters(tmp_path: Path) -> None:
    known = truing.load_uncertainty(write_identification(tmp_path))
    assert (
        known.names == ("J2.a", "J3.d")
        and known.values == (0.1, 0.1)
        and known.covariance.tolist() == [[4e-10, 1e-10], [1e-10, 9e-10]]
    )


@pytest.mark.parametrize(
    ("covariance", "message"),
    [
        ("name,J2.a\nJ2.a,1\n", "lacks J3.d, which was fitted"),
        ("name,J2.a,J3.d,J9.d\n", "has J9.d, which was not fitted"),
        ("J2.a,J3.d\n1,2\n", "no column 'name'"),
        ("name,J2.a,J3.d\nJ3.d,1,0\nJ2.a,0,1\n", "rows and columns have different names"),
        ("name,J2.a,J3.d\nJ2.a,1,0.5\nJ3.d,0,1\n", "not symmetric"),
        ("name,J2.a,J3.d\nJ2.a,-1,0\nJ3.d,0,1\n", "variance below zero"),
        ("name,J2.a,J3.d\nJ2.a,nan,0\nJ3.d,0,1\n", "found 'nan'"),
    ],
)
def test_a_covariance_of_something_else_is_refused(tmp_path: Path, covariance: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        truing.load_uncertainty(write_identification(tmp_path, covariance=covariance))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is not JSON"),
        ("{", "is not JSON"),
        ("[]", "expected 'truing-identification/1'"),
        ('{"format": "truing-plan/1"}', "found format 'truing-plan/1'"),
        (
            '{"format": "truing-identification/1", "parameters": [{"name": "a"}]}',
            "its parameters cannot be read",
        ),
        ('{"format": "truing-identification/1", "parameters": []}', "no fitted parameters"),
    ],
)
def test_a_result_of_something_else_is_refused(tmp_path: Path, text: str, message: str) -> None:
    write_identification(tmp_path)
    (tmp_path / "result.json").write_text(text)
    with pytest.raises(InputError, match=message):
        truing.load_uncertainty(tmp_path / "result.json")


# ---- Whatever is in a file -----------------------------------------------------------------------

TARGETS = b"""\
x_mm,y_mm,z_mm,qw,qx,qy,qz,task,roll_rad,roll_lower_deg,roll_upper_deg,lead_lower_rad,lead_upper_rad,q1_rad,q2_rad,q3_deg,q4_rad,q5_rad,q6_rad,dir1,dir2,dir3,dir4,dir5,dir6,payload_kg,t_s
300,20,400,1,0,0,0,torch,0.1,-10,10,-0.1,0.1,0.1,0,10,0,0.5,0,1,0,-1,0,0,0,1.5,0
350,-20,420,0,1,0,0,pose,,,,,,0.2,0,20,0,0.5,0,1,0,-1,0,0,0,0,1
310,0,390,,,,,point,,,,,,0.2,0,20,0,0.5,0,0,0,0,0,0,0,0,2
"""


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def check_targets(folder: Path, data: bytes) -> None:
    path = folder / "targets.csv"
    path.write_bytes(data)
    for program in (False, True):
        try:
            read = truing.load_targets(path, ROBOT, program=program)
        except InputError as error:
            assert "targets.csv" in str(error) and "\n" not in str(error)
            continue
        assert read.count > 0 and len(read.conditions) in (0, read.count)
        for task in read.tasks:
            assert np.isfinite(task.T_measurement_target).all() and task.roll[0] <= task.roll[1]
        if read.joints is not None:
            assert read.joints.shape == (read.count, 6) and np.isfinite(read.joints).all()


@quick
@given(data=mutated(TARGETS))
@example(data=TARGETS)
def test_targets_with_faults(folder: Path, data: bytes) -> None:
    check_targets(folder, data)


@quick
@given(text=st.text(alphabet='0123456789.,-+e"\n\r na', max_size=120))
def test_targets_of_any_cells(folder: Path, text: str) -> None:
    check_targets(folder, b"x_m,y_m,z_m,qw,qx,qy,qz\n" + text.encode())


@quick
@given(data=st.binary(max_size=300))
def test_targets_of_any_bytes(folder: Path, data: bytes) -> None:
    check_targets(folder, data)


def check_scene(folder: Path, data: bytes) -> None:
    path = folder / "scene.yaml"
    path.write_bytes(data)
    try:
        scene = truing.load_scene(path, ROBOT)
    except InputError as error:
        assert "scene.yaml" in str(error) and "\n" not in str(error)
        return
    truing.model.validate_scene(scene, ROBOT)
    truing.model.nearest_contact(scene, ROBOT, np.zeros(6))


@quick
@given(data=mutated(SCENE))
@example(data=SCENE)
def test_scene_with_faults(folder: Path, data: bytes) -> None:
    check_scene(folder, data)


@quick
@given(text=st.text(alphabet="ab:{}[]-,#&*!|>'\"%@`? \n\t019.~", max_size=80))
def test_scene_of_any_yaml(folder: Path, text: str) -> None:
    check_scene(folder, b"format: truing-scene/1\n" + text.encode())
