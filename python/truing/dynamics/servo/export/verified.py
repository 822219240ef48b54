# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A written MJCF run on held-out motion by MuJoCo alone, beside the file that was diagnosed."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.commanded import Commanded, command_kind, commanded_mjcf
from truing.dynamics.recorded import Recorded
from truing.dynamics.rollout import WINDOWS, Rollout, judgement_dict, possible, spans_of
from truing.dynamics.servo.chain import ServoChain
from truing.dynamics.servo.export.ours import chain_paths
from truing.dynamics.simulate import COMMANDED_HORIZONS, Spans, judge
from truing.errors import InputError, InputWarning
from truing.files import is_mjcf, load_robot

Motion = Sequence[tuple[_core.Recording, NDArray[np.bool_]]]


def judge_servo(
    models: dict[str, Path], joints: Sequence[str], motion: Motion, ours: tuple[ServoChain, str] | None = None
) -> Rollout:
    """MJCF files with servos at `joints`, on the rows of recordings that were held out.

    ours: a chain, and the arm without drives: "named" is what it does over the same windows, with all laws.
    What cannot be simulated (no held-out rows, a file without drives) says why in `why_not`.
    """
    held = [(recording, spans_of(recording, rows)) for recording, rows in motion if rows.any()]
    if not held:
        return Rollout(None, "nothing was held out: give recordings that nothing was fitted to (--held-out)")
    recordings: list[Recorded] = [recording for recording, _ in held]
    spans: list[Spans] = [of for _, of in held]
    try:
        kind = command_kind([recording for recording, _ in held])
        if kind is None:
            raise InputError("the recordings have torques: expected those that were diagnosed")
        runnable = {name: _commanded(file, joints, kind) for name, file in models.items()}
        horizons = possible(COMMANDED_HORIZONS, recordings, spans)
        judged = judge(runnable, recordings, horizons, within=spans, most=WINDOWS)
        if ours is not None:
            path = chain_paths(*ours, [recording for recording, _ in held], judged.windows)
            written = judged.simulated.pop("exported")
            judged.simulated.update({"named": path, "exported": written})
        return Rollout(judged)
    except (ValueError, RuntimeError) as error:  # InputError, and what MuJoCo says to a model
        return Rollout(None, str(error))


def _commanded(file: Path, joints: Sequence[str], kind: Any) -> Commanded:
    """A file with the servos of these joints, which are the first of its chain."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        if not is_mjcf(file):
            raise InputError(f"{file}: is no MJCF, whose drives could be run")
        whole = load_robot(file, any_tool=True)
        names = [joint.name for joint in whole.joints if not joint.passive]
        if names != list(joints):
            whole = load_robot(file, tip_link=_carrier(file, joints[-1]), any_tool=True)
    names = [joint.name for joint in whole.joints if not joint.passive]
    if names != list(joints):
        raise InputError(f"{file}: has the joints {', '.join(names)}, expected {', '.join(joints)}")
    return commanded_mjcf(file, whole, kind)


def _carrier(file: Path, joint: str) -> str:
    """The body that a joint moves."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(file))
    return str(model.body(model.jnt_bodyid[model.joint(joint).id]).name)


def servo_rollout_dict(found: Rollout) -> dict[str, Any]:
    """The part `rollout` of result.json: by model and joint the rms at each horizon."""
    if found.judgement is None:
        return {"horizon_s": [], "held_out": {}, "why_not": found.why_not}
    return {**judgement_dict(found.judgement, "held_out"), "why_not": "", **_words(found)}


def _words(found: Rollout) -> dict[str, Any]:
    judged = found.judgement
    assert judged is not None
    longest = max(judged.windows.horizons)
    errors = {model: float(np.mean(judged.rms(model, longest))) for model in judged.simulated}
    others = {"named": "the chain with all its laws", "nominal": "the file before"}
    beside = [f"{words} by {_shown(errors[model])}" for model, words in others.items() if model in errors]
    written = f"{longest:g} s ahead the written MJCF is off by {_shown(errors['exported'])}"
    worse = errors["exported"] > errors.get("nominal", np.inf)
    return {
        "sentence": f"{', '.join([written, *beside])} (mean over the joints)",
        "worse": ["the written MJCF moves worse than the file"] if worse else [],
    }


def _shown(value: float) -> str:
    return f"{np.degrees(value):.2f}°"
