# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The value `Recording`: what goes in comes out, cannot be written to, and is checked."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from truing._core import Joint, Recording, Robot, validate_recording
from truing.errors import InputError

ROBOT = Robot("arm", joints=[Joint("J1"), Joint("J2", a=0.3)])
TIME = 0.01 * np.arange(30)
POSITION = np.column_stack([np.sin(TIME), np.cos(TIME)])


def recording(**other: object) -> Recording:
    return Recording("swing", time=TIME, position=POSITION, **other)  # type: ignore[arg-type]


def test_what_goes_in_comes_out_and_cannot_be_written_to() -> None:
    found = recording(
        torque=POSITION[:, ::-1].astype(np.float32), columns={"payload_kg": [2.5] * 30}, test=True
    )
    assert (found.name, len(found), found.test) == ("swing", 30, True)
    assert np.array_equal(found.position, POSITION)
    assert np.array_equal(found.torque, POSITION[:, ::-1].astype(np.float32))
    assert np.array_equal(found.columns["payload_kg"], np.full(30, 2.5))
    assert found.speed.shape == found.command.shape == (30, 0)
    assert repr(found) == "Recording('swing', 30 rows in 0.29 s, 2 joints, with torque, payload_kg, test)"
    for array in (found.time, found.position, found.columns["payload_kg"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(TypeError):
        found.columns["mine"] = TIME  # type: ignore[index]
    with pytest.raises(AttributeError):
        found.name = "other"  # type: ignore[misc]


def test_arrays_are_copied_and_outlive_their_recording() -> None:
    position = POSITION.copy()
    found = Recording("swing", time=TIME, position=position)
    position[:] = 7.0
    kept = found.position
    del found
    assert np.array_equal(kept, POSITION)


def test_replace_and_pickling_keep_the_rest() -> None:
    first = recording(current=POSITION, columns={"volt_V": 12.0 * np.ones(30)})
    for other in (first.replace(), first.copy(), copy.copy(first), pickle.loads(pickle.dumps(first))):
        assert repr(other) == repr(first)
        assert np.array_equal(other.current, POSITION)
        assert np.array_equal(other.columns["volt_V"], np.full(30, 12.0))
    assert first.replace(test=True).test and not first.test
    with pytest.raises(TypeError):
        first.replace(torgue=POSITION)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"torque": POSITION[:5]}, r"torque must have shape \(30, joints\): .* found shape \(5, 2\)"),
        ({"torque": TIME}, r"torque must have shape \(30, joints\)"),
        ({"columns": {"x": TIME[:5]}}, "column x has 5 rows, time has 30"),
        ({"columns": {"x": POSITION}}, r"column x must have shape \(n,\)"),
        ({"time": POSITION}, r"time must have shape \(n,\); found shape \(30, 2\)"),
        ({"speed": [["a", "b"]] * 30}, "speed holds .* values, not numbers"),
    ],
)
def test_other_shapes_are_refused(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        recording().replace(**keywords)


def test_values_are_checked_by_name_and_row() -> None:
    validate_recording(recording(torque=np.column_stack([TIME, np.full(30, np.nan)])), ROBOT)
    torque = POSITION.copy()
    torque[4, 1] = np.nan
    with pytest.raises(
        InputError, match="recording 'swing', column tau2, row 5: found nan, expected a finite"
    ):
        validate_recording(recording(torque=torque), ROBOT)
    with pytest.raises(InputError, match=r"position has shape \(30, 2\), expected \(30, 1\)"):
        validate_recording(recording(), ROBOT.replace(joints=[Joint("J1")]))
