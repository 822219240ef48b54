# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""ROS: frames that stay, as lines of tf2_ros static_transform_publisher."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import numpy as np

from truing.controllers.frames import NamedFrame
from truing.controllers.written import Written, numbers
from truing.errors import InputError
from truing.rotations import quaternions_from_rotations

FILE = "static_transforms.sh"
_LENGTH, _QUATERNION = 7, 9  # digits behind the point


def written(frames: Sequence[NamedFrame], parents: Sequence[str]) -> Written:
    """parents: the frame that each is in."""
    lines = [_line(frame, parent) for frame, parent in zip(frames, parents, strict=True)]
    body = "".join(f"# {frame.about}\n{line}\n" for frame, line in zip(frames, lines, strict=True))
    return Written(
        files={FILE: "#!/bin/sh\n# m, quaternion x y z w\n" + body},
        values={"lines": lines},
        lines=[(frame.name, line) for frame, line in zip(frames, lines, strict=True)],
        notes=[f"frames are printed to {10.0 ** (3 - _LENGTH):g} mm"],
    )


def _line(frame: NamedFrame, parent: str) -> str:
    if frame.name == parent:
        raise InputError(f"parent and child are both {parent!r}: name them otherwise (--parent, --child)")
    w, x, y, z = quaternions_from_rotations(np.asarray(frame.T)[None, :3, :3])[0]
    place = dict(zip("xyz", numbers(list(frame.T[:3, 3]), _LENGTH), strict=True))
    turn = dict(zip(("qx", "qy", "qz", "qw"), numbers([x, y, z, w], _QUATERNION), strict=True))
    values = " ".join(f"--{key} {text}" for key, text in {**place, **turn}.items())
    return (
        f"ros2 run tf2_ros static_transform_publisher {values} --frame-id {shlex.quote(parent)}"
        f" --child-frame-id {shlex.quote(frame.name)}"
    )
