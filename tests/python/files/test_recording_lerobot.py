# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""LeRobot data sets that the test writes with pyarrow, in the layouts of versions 2.1 and 3.0."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import given, strategies as st

from fuzzing import mutated, quick
from truing import _core
from truing.dynamics import load_recordings
from truing.errors import InputError, InputWarning

ROBOT = _core.Robot(
    "arm",
    joints=[
        _core.Joint("shoulder_pan", a=0.1, lower=-2.0, upper=2.0),
        _core.Joint("elbow_flex", a=0.1, lower=-1.0, upper=2.0),
    ],
)
NAMES = ["elbow_flex.pos", "shoulder_pan.pos", "gripper.pos"]
ROWS = 30


def states(episode: int) -> np.ndarray:
    k = np.arange(ROWS)
    return np.column_stack([50.0 * np.sin(0.1 * k + episode), np.full(ROWS, 10.0 * episode), 1.0 + k])


def episode_table(episode: int, rows: int = ROWS, **other: Any) -> pa.Table:
    state = states(episode)[:rows].astype(np.float32)
    columns: dict[str, Any] = {
        "observation.state": pa.array(state.tolist(), pa.list_(pa.float32(), 3)),
        "action": pa.array((state + 1.0).tolist(), pa.list_(pa.float32())),
        "timestamp": pa.array(np.arange(rows, dtype=np.float32) / np.float32(30.0)),
        "frame_index": pa.array(np.arange(rows)),
        "episode_index": pa.array(np.full(rows, episode)),
        "index": pa.array(np.arange(rows)),
        "task_index": pa.array(np.zeros(rows, dtype=np.int64)),
    }
    columns.update(other)
    return pa.table({name: column for name, column in columns.items() if column is not None})


def data_set(
    folder: Path,
    tables: Sequence[pa.Table],
    version: str = "v2.1",
    names: Any = NAMES,
    splits: Mapping[str, str] | None = None,
    action_names: Any = None,
) -> Path:
    path = folder / "pick"
    chunk = path / "data" / "chunk-000"
    chunk.mkdir(parents=True, exist_ok=True)
    (path / "meta").mkdir(exist_ok=True)
    features = {
        "observation.state": {"dtype": "float32", "shape": [3], "names": names},
        "action": {"dtype": "float32", "shape": [3], "names": action_names or names},
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
    }
    info = {
        "codebase_version": version,
        "fps": 30,
        "features": features,
        "splits": splits or {"train": "0:9"},
    }
    (path / "meta" / "info.json").write_text(json.dumps(info))
    if version == "v2.1":
        for number, table in enumerate(tables):
            pa.parquet.write_table(table, chunk / f"episode_{number:06d}.parquet")
    else:
        pa.parquet.write_table(pa.concat_tables(tables), chunk / "file-000.parquet")
    return path


def refusal(path: Path, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        load_recordings(path, ROBOT, **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
@pytest.mark.parametrize("names", [NAMES, {"motors": ["main_" + name[:-4] for name in NAMES]}])
def test_every_episode_is_a_recording(tmp_path: Path, version: str, names: Any) -> None:
    path = data_set(
        tmp_path, [episode_table(k) for k in range(3)], version, names, {"train": "0:2", "test": "2:3"}
    )
    found = load_recordings(path, ROBOT, units="deg")
    assert [recording.name for recording in found] == [f"pick/episode_{k:06d}" for k in range(3)]
    assert [recording.test for recording in found] == [False, False, True]
    for episode, recording in enumerate(found):
        degrees = states(episode)[:, [1, 0]]
        assert recording.time == pytest.approx(np.arange(ROWS) / 30.0, abs=1e-6)
        assert recording.position == pytest.approx(np.radians(degrees), abs=1e-6)
        assert recording.command == pytest.approx(np.radians(degrees + 1.0), abs=1e-6)
        assert recording.torque.shape == (ROWS, 0)


def test_percent_are_of_the_joint_s_limits(tmp_path: Path) -> None:
    path = data_set(tmp_path, [episode_table(1)])
    (found,) = load_recordings(path, ROBOT, units="percent")
    assert found.position[:, 0] == pytest.approx(0.2)  # 10 % of -2 ... 2
    assert found.position[:, 1] == pytest.approx(0.5 + 0.015 * states(1)[:, 0], abs=1e-6)
    unlimited = ROBOT.replace(joints=[ROBOT.joints[0], ROBOT.joints[1].replace(upper=math.inf)])
    with pytest.raises(InputError, match="joint 'elbow_flex' of the robot has no limits"):
        load_recordings(path, unlimited, units="percent")
    assert "found 130 for joint 'shoulder_pan', expected percent of its range from -100 to 100" in refusal(
        data_set(tmp_path, [episode_table(13)]), units="percent"
    )


def test_a_gripper_goes_from_0_to_100(tmp_path: Path) -> None:
    path = data_set(tmp_path, [episode_table(0)])
    jaw = _core.Joint("gripper", a=0.1, lower=-0.5, upper=1.5)
    robot = ROBOT.replace(joints=[*ROBOT.joints, jaw])
    (found,) = load_recordings(path, robot, units="deg")
    assert found.position[:, 2] == pytest.approx(-0.5 + 0.02 * states(0)[:, 2], abs=1e-6)


def test_units_have_to_be_said(tmp_path: Path) -> None:
    path = data_set(tmp_path, [episode_table(2)])
    assert "does not say in which unit positions are (the largest is" in refusal(path)
    assert "it looks like degrees or percent" in refusal(path, units="rad")
    assert "does not say" in refusal(path, units="turns")


def test_joints_says_what_the_components_are(tmp_path: Path) -> None:
    path = data_set(tmp_path, [episode_table(1)], names=["m1", "m2", "m3"])
    assert "there is no joint shoulder_pan, elbow_flex; the joints there are m1, m2, m3" in refusal(
        path, units="deg"
    )
    (found,) = load_recordings(path, ROBOT, joints="elbow_flex,shoulder_pan,-", units="deg")
    assert found.position[:, 0] == pytest.approx(math.radians(10.0))


def test_actions_of_another_kind_are_left_out_and_said(tmp_path: Path) -> None:
    path = data_set(tmp_path, [episode_table(1)], action_names=["x", "y", "z"])
    with pytest.warns(InputWarning, match="actions are not the positions of the joints"):
        (found,) = load_recordings(path, ROBOT, units="deg")
    assert found.command.shape == (ROWS, 0)
    (found,) = load_recordings(data_set(tmp_path, [episode_table(1, action=None)]), ROBOT, units="deg")
    assert found.command.shape == (ROWS, 0)


def test_short_episodes_are_left_out_and_said(tmp_path: Path) -> None:
    path = data_set(tmp_path, [episode_table(0), episode_table(1, rows=7)], "v3.0")
    with pytest.warns(InputWarning, match="episode 1: has 7 rows and is left out"):
        assert len(load_recordings(path, ROBOT, units="deg")) == 1
    only = data_set(tmp_path / "b", [episode_table(0, rows=7)])
    with pytest.warns(InputWarning):
        assert "holds no episode of at least 20 rows" in refusal(only, units="deg")


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    state = states(0)
    state[4, 1] = np.nan
    broken = {
        "column 'observation.state', value 14: found nan": {
            "observation.state": pa.array(state.tolist(), pa.list_(pa.float64()))
        },
        "row 3: found 2 numbers, expected 3": {
            "observation.state": pa.array([[1.0] * (2 if k == 2 else 3) for k in range(ROWS)])
        },
        "expected a list of 3 numbers in each row": {"observation.state": pa.array(np.zeros(ROWS))},
        "there is no column 'timestamp'": {"timestamp": None},
        "episode 0, row 2, timestamp: found 0 s a second time": {"timestamp": pa.array(np.zeros(ROWS))},
    }
    for message, other in broken.items():
        assert message in refusal(data_set(tmp_path, [episode_table(0, **other)]), units="deg")
    (tmp_path / "twice").mkdir()
    twice = data_set(tmp_path / "twice", [episode_table(k) for k in (0, 1, 0)], "v3.0")
    assert "episode 0: is there twice" in refusal(twice, units="deg")
    path = data_set(tmp_path, [episode_table(0)])
    (path / "meta" / "info.json").write_text("{")
    assert "info.json: is not JSON" in refusal(path, units="deg")
    (path / "meta" / "info.json").write_text('{"features": {"action": {}}}')
    assert "found action, expected the feature 'observation.state'" in refusal(path, units="deg")
    path = data_set(tmp_path, [episode_table(0)])
    (path / "data" / "chunk-000" / "episode_000000.parquet").write_bytes(b"PAR1nonsense")
    assert "episode_000000.parquet: is a damaged Parquet file" in refusal(path, units="deg")
    (path / "data" / "chunk-000" / "episode_000000.parquet").unlink()
    assert "there is no file data/chunk-*/*.parquet" in refusal(path, units="deg")


WHOLE = episode_table(0)


def check(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            for recording in load_recordings(path, ROBOT, units="deg"):
                _core.validate_recording(recording, ROBOT)
        except InputError as error:
            assert path.name in str(error)
            assert "\n" not in str(error)


@quick
@given(data=st.data())
def test_faults_end_in_one_error(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = data_set(tmp_path_factory.getbasetemp(), [WHOLE])
    info = path / "meta" / "info.json"
    info.write_bytes(data.draw(mutated(info.read_bytes())))
    check(path)
    info.unlink()
    data_set(tmp_path_factory.getbasetemp(), [WHOLE])
    file = path / "data" / "chunk-000" / "episode_000000.parquet"
    file.write_bytes(data.draw(mutated(file.read_bytes())))
    check(path)


def test_options_of_other_files_are_refused(tmp_path: Path) -> None:
    path = data_set(tmp_path, [episode_table(0)])
    assert "--topic (in Python: topic=) is of bags" in refusal(path, units="deg", topic="/joint_states")
    (tmp_path / "run.csv").write_text("t_s\n0\n")
    assert "--units (in Python: units=) is of LeRobot data sets" in refusal(tmp_path / "run.csv", units="deg")
    (tmp_path / "empty").mkdir()
    assert "is a folder, and neither a bag" in refusal(tmp_path / "empty")
