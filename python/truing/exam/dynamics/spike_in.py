# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Sealed effects added to the torques of real recordings, and columns of theirs that are withheld."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from truing.exam.dynamics import recordings
from truing.exam.dynamics.laws import LISTED, Scene
from truing.exam.dynamics.noise import reshuffled
from truing.exam.dynamics.recordings import Real
from truing.exam.dynamics.robots import Floats
from truing.exam.dynamics.scenes import (
    ARM_WIDE,
    TRIES,
    Case,
    Label,
    Recorded,
    Table,
    looks_like,
    told,
    unit_torques,
    urdf,
)
from truing.exam.dynamics.sizing import View
from truing.exam.scenes import NoSetError, Request

_LEFT_OUT = frozenset({"thermal_friction", "joint_elasticity", "backlash", "link_inertia", "warmup"})
NAMES = tuple(name for name in LISTED if name not in _LEFT_OUT)
"""What is added to recordings: no temperatures are in them, and their arms cannot be driven again."""
_SIZES = (0.5, 1.0, 2.0)
_CORRELATED = 16.0  # rows at 25 Hz that count as one


def spike(request: Request) -> Case:
    """One effect on what the flexible fit leaves; in every third set on the torques as they were measured,
    beside whatever the real arm hides.
    """
    rng = request.rng
    source = recordings.recorded(request.which)
    raw = (request.number // 4) % 3 == 2
    sigma = source.sigma_standard if raw else source.sigma
    learned = [one for one in source.recordings if not one.test]
    view = View([one.scene for one in learned], sigma, False, 1.0 / _CORRELATED)
    size = float(rng.choice(_SIZES))
    for _ in range(TRIES):
        name = str(rng.choice(NAMES))
        joint = 0 if name in ARM_WIDE else int(rng.integers(source.arm.n))
        hidden = LISTED[name](source.arm, joint, rng)
        seen = view.size(view.stacked(unit_torques(view.scenes, hidden)))
        if (
            name == "spring"
            and not _loaded(learned[0].scene, joint)
            or size / max(seen, 1e-9) > hidden.largest
        ):
            request.throw_away("no machine has it so large")
            continue
        amplitude = size / seen
        added = [amplitude * unit for unit in unit_torques([one.scene for one in source.recordings], hidden)]
        column = view.stacked([a for a, one in zip(added, source.recordings, strict=True) if not one.test])
        recorded = tuple(
            _handed(one, (one.measured if raw else one.scene.total + one.residual) + own)
            for one, own in zip(source.recordings, added, strict=True)
        )
        label = _label(request, source.arm.name, sigma) | {
            "effects": [told(hidden)],
            "acceptable": looks_like(view, hidden, column, frozenset(), 0),
            "amplitudes": [amplitude],
            "sizes": [view.size(column)],
            "wanted": [size],
            "size_over_noise": size,
            "kind": "raw" if raw else "residual",
        }
        return Case(urdf(source.arm), recorded, (), label)
    raise NoSetError(f"no effect fits in {TRIES} draws")


def _loaded(scene: Scene, joint: int) -> bool:
    torque = scene.motion.torque[:, joint]
    return float(np.std(torque)) > 0.3 * float(scene.arm.coulomb[joint])


def quiet(request: Request) -> Case:
    """The arm of the data sheet with usual friction along the recorded motion, and noise of the recorded
    spectrum.
    """
    source = recordings.recorded(request.which)
    recorded = tuple(
        _handed(one, one.scene.total + reshuffled(one.residual, request.rng)) for one in source.recordings
    )
    label = _label(request, source.arm.name, source.sigma) | {"kind": "recorded"}
    return Case(urdf(source.arm), recorded, (), label)


def payload_withheld(request: Request) -> Case:
    """Recordings without a load, and one with 2.805 kg of which nobody is told. Nothing is added."""
    source = recordings.recorded_with_load()
    rng = request.rng
    free = [one for one in source.recordings if "load" not in one.name]
    kept = [free[k] for k in sorted(rng.choice(len(free), 2, replace=False))]
    loaded = next(one for one in source.recordings if "load" in one.name)
    half = len(loaded.t) // 2
    parts = [*kept, _part(loaded, slice(0, half), "loaded_1"), _part(loaded, slice(half, None), "loaded_2")]
    parts = [replace(one, test=k == len(parts) - 1) for k, one in enumerate(parts)]
    last = f"J{source.arm.n}"
    label = _label(request, source.arm.name, source.sigma_standard) | {
        "effects": [{"effect": "payload", "joints": []}],
        "acceptable": [{"effect": "link_inertia", "joints": [last], "of": 0}],
        "size_over_noise": 3.0,
        "kind": "real_payload",
        "withheld": ["payload"],
    }
    return Case(urdf(source.arm), tuple(_handed(one, one.measured) for one in parts), (), label)


def _part(one: Real, rows: slice, name: str) -> Real:
    qd = one.qd[rows] if one.qd is not None else None
    t = one.t[rows] - one.t[rows][0]
    return replace(one, name=name, t=t, q=one.q[rows], qd=qd, measured=one.measured[rows])


def _label(request: Request, arm: str, sigma: Floats) -> Label:
    return {
        "family": request.family,
        "source": "spike",
        "arm": arm,
        "effects": [],
        "acceptable": [],
        "sizes": [],
        "size_over_noise": 0.0,
        "noise": "real",
        "noise_sigma": sigma.tolist(),
        "payload_kg": None,
        "geometry_underneath": False,
        "underneath": [],
        "drawn_anew": dict(request.anew),
    }


def _handed(one: Real, torque: Floats) -> Recorded:
    n = one.q.shape[1]
    table: Table = {"t_s": one.t}
    table.update({f"q{j + 1}_rad": one.q[:, j] for j in range(n)})
    if one.qd is not None:
        table.update({f"qd{j + 1}_rad_s": one.qd[:, j] for j in range(n)})
    table.update({f"tau{j + 1}_Nm": torque[:, j] for j in range(n)})
    return Recorded(one.name, one.test, table)
