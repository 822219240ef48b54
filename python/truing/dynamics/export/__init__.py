# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The calibrated robot for a simulator: MuJoCo (MJCF), URDF, Isaac Lab; and what could not be written, by
name."""

from __future__ import annotations

import inspect
import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.chains import coupling_of
from truing.dynamics.export import beside, isaaclab, mjcf, refit, urdf
from truing.dynamics.export.chain import Chain, chain_of, file_name
from truing.dynamics.export.parts import (
    IN_GRAVITY,
    NotWritten as NotWritten,
    Reference,
    parts_of,
    recorded_motion,
    reference_motion,
    with_gravity_turned,
)
from truing.dynamics.recorded import Recorded
from truing.errors import InputError
from truing.files.output import atomic_output_dir

Simulator = Literal["mjcf", "urdf", "isaaclab"]

CALLBACKS = "callbacks.py"
CALLBACKS_MODEL = "callbacks.xml"  # what callbacks.py belongs to where the model alone was fitted anew
NOT_WRITTEN = "not_written.yaml"
_FORMATS = {"mjcf": "MJCF", "urdf": "URDF", "isaaclab": "Isaac Lab"}
_NEAR_M = 1e-8  # [m] between the robot's and the written model's tools
_NEAR_NM = 1e-7  # of the largest gravity torque


@dataclass(frozen=True)
class Exported:
    """What was written."""

    folder: Path
    model: Path  # the file for the simulator
    callbacks: Path | None  # MuJoCo: what has no field, as a Python module
    not_written: tuple[NotWritten, ...]  # largest first
    robot: _core.Robot = field(repr=False)
    alone: _core.Robot = field(repr=False)  # what `model` has: `robot`, or what was fitted anew
    chain: Chain = field(repr=False)  # the robot as it was written
    callbacks_model: Path | None = None  # the file that `callbacks` belongs to, if it is not `model`
    refitted: tuple[str, ...] = ()  # parameters without which `model` was fitted anew
    not_refitted: str = ""  # why not, where that would have been better

    def summary(self) -> str:
        """What was written, and what was not, in lines."""
        lines = [f"{self.model}"]
        if self.callbacks is not None:
            lines.append(f"{self.callbacks}: torques that the simulator has no field for")
        if self.callbacks_model is not None:
            lines.append(f"{self.callbacks_model}: the model that these belong to")
        lines += [text for text in (refit_words(self.refitted), self.not_refitted) if text]
        for item in self.not_written:
            size = "" if math.isnan(item.size) else f" ({item.size:.2g} Nm)"
            lines.append(f"not written: {item.name}{size}: {item.reason}")
        return "\n".join(lines)


def refit_words(parameters: Sequence[str]) -> str:
    """A sentence; "" for none."""
    if not parameters:
        return ""
    return f"Coulomb friction, damping and bodies were fitted anew without {', '.join(parameters)}"


def export(
    robot: _core.Robot,
    to: Simulator,
    out: str | os.PathLike[str],
    source: str | os.PathLike[str] | None = None,
    recordings: Sequence[Recorded] = (),
    cutoff: float | None = None,
) -> Exported:
    """Writes a robot with its bodies and `torque_effects` for a simulator, into the folder `out`.

    to: "mjcf" (MuJoCo 4, robot.xml and perhaps callbacks.py), "urdf" (robot.urdf) or "isaaclab" (robot.urdf
    and actuators.py). source: the URDF file that the robot was read from: its meshes and names are kept
    (not for mjcf). not_written.yaml lists what the model lacks, each with its size in Nm. recordings: what
    the robot was fitted to, and nothing that was held out. Where the format does not hold some effects,
    Coulomb friction, damping and bodies are fitted anew to them without these; callbacks.py then belongs to
    callbacks.xml, which has the robot as it is, but for friction that fades at rest: at its joints friction
    that holds is fitted anew. Sizes are stated on them. Without any, friction and damping
    stand for what is lacking, on a motion through the robot's range with the torques of gravity. cutoff:
    [Hz] that the robot was fitted with.

    The MJCF is loaded again and compared with the robot: tool pose, and torques against gravity. Raises
    InputError: robot without masses, unknown simulator, source that is not this robot's, an effect without
    its constant, mujoco not installed; RuntimeError if the written model disagrees with the robot.
    """
    if to not in get_args(Simulator):
        raise InputError(f"simulator {to!r} is not known, expected one of {', '.join(get_args(Simulator))}")
    if to == "mjcf" and source is not None:
        raise InputError(
            "source is not used for mjcf, whose chain is written anew: leave it out, or export to urdf"
        )
    text = None if source is None else _source_text(Path(source))
    upright = with_gravity_turned(robot)
    whole, faded, not_held = _holding(_written(upright, to, text, recordings), to, text, recordings, cutoff)
    alone, parameters, why_not = _refitted(whole, upright, to, text, recordings, cutoff)
    parameters = [*(item.name for item in faded), *parameters]
    why_not = "; ".join(words for words in (not_held, why_not) if words)
    files = dict(alone.files)
    if whole.callbacks:
        files[CALLBACKS] = whole.callbacks
    if whole.callbacks and alone is not whole:
        files[CALLBACKS_MODEL] = whole.files[whole.main]
    left = sorted(
        [*alone.left, *faded], key=lambda item: -item.size if math.isfinite(item.size) else -math.inf
    )
    if to != "mjcf" and upright is not robot:
        way = ", ".join(f"{value:.4g}" for value in upright.gravity)
        reason = f"gravity is the scene's: ({way}) m/s^2 in the base frame"
        left.append(NotWritten(IN_GRAVITY, math.nan, reason))
    where = "the recordings" if recordings else "a motion through the robot's range at the torques of gravity"
    files[NOT_WRITTEN] = listed(robot.name, to, left, where, parameters, why_not)
    inputs = [] if source is None else [Path(source)]
    with atomic_output_dir(out, inputs=inputs, obsolete=[CALLBACKS, CALLBACKS_MODEL]) as folder:
        for file, content in files.items():
            (folder / file).write_text(content, encoding="utf-8")
    folder = Path(out)
    beside_it, its_model = (folder / n if n in files else None for n in (CALLBACKS, CALLBACKS_MODEL))
    return Exported(
        folder,
        folder / alone.main,
        beside_it,
        tuple(left),
        robot,
        alone.robot,
        whole.chain,
        its_model,
        tuple(parameters),
        why_not,
    )


@dataclass(frozen=True)
class _Written:
    """A robot in a format's words."""

    robot: _core.Robot
    chain: Chain
    main: str  # name of the file for the simulator
    files: dict[str, str]  # text by name
    callbacks: str  # text of callbacks.py; "" if it needs none
    left: list[NotWritten]
    nearly: frozenset[str] = frozenset()  # effects of `left` that the file has nearly

    def lacking(self) -> list[str]:
        """Parameters without which the robot is to be fitted anew."""
        return refit.lacking(self.robot, (item for item in self.left if item.name not in self.nearly))


def _written(
    robot: _core.Robot, to: Simulator, source: str | None, recordings: Sequence[Recorded], alone: bool = False
) -> _Written:
    """alone: the MJCF is used without callbacks.py, which it says does not belong to it."""
    chain = chain_of(robot)
    usual = reference_motion(robot, chain)
    reference = recorded_motion(robot, chain, recordings) if recordings else usual
    parts = parts_of(robot, chain, reference)
    name = file_name(robot.name)
    if to == "mjcf":
        model = mjcf.model_of(chain, parts, reference, levers=alone)
        text = mjcf.write(robot, chain, parts, model, CALLBACKS_MODEL if alone else "")
        _check(robot, chain, usual, text)
        callbacks = _callbacks_text(chain, model) if model.beside else ""
        nearly = frozenset(tendon.effect for tendon in model.levers)
        files = {f"{name}.xml": text}
        return _Written(robot, chain, f"{name}.xml", files, callbacks, model.not_written, nearly)
    text, left = urdf.write(robot, chain, parts, reference, source)
    files = {f"{name}.urdf": text}
    if to == "urdf":
        return _Written(robot, chain, f"{name}.urdf", files, "", left)
    files["actuators.py"], left = isaaclab.write(robot, chain, parts, reference)
    return _Written(robot, chain, "actuators.py", files, "", left)


def _holding(
    whole: _Written, to: Simulator, source: str | None, recordings: Sequence[Recorded], cutoff: float | None
) -> tuple[_Written, list[NotWritten], str]:
    """The robot with friction that holds where it fades at rest, fitted anew; what is lost by that, which no
    simulator has; or why it was not done."""
    parameters = refit.fading(whole.robot)
    if not parameters:
        return whole, [], ""
    wanted = f"not fitted anew without {', '.join(parameters)}"
    if not recordings:
        return whole, [], f"{wanted}: that needs the recordings that the robot was fitted to"
    try:
        robot = refit.with_friction_that_holds(whole.robot, recordings, cutoff)
    except InputError as error:
        return whole, [], f"{wanted}: {error}"
    lost = [
        replace(item, reason=f"{item.reason}; fitted anew without it")
        for item in whole.left
        if item.name in parameters
    ]
    return _written(robot, to, source, recordings), lost, ""


def _refitted(
    whole: _Written,
    robot: _core.Robot,
    to: Simulator,
    source: str | None,
    recordings: Sequence[Recorded],
    cutoff: float | None,
) -> tuple[_Written, list[str], str]:
    """What is written where no callback adds anything: `whole`, or the robot fitted without what the format
    does not hold. Then the parameters that this is; or why it was not done."""
    bare = bool(whole.callbacks) and bool(recordings)
    near = _written(whole.robot, to, source, recordings, alone=True) if bare else whole
    parameters = near.lacking()
    if not parameters:
        return near if near.nearly else whole, [], ""
    wanted = f"not fitted anew without {', '.join(parameters)}"
    if not recordings:
        return whole, [], f"{wanted}: that needs the recordings that the robot was fitted to"
    try:
        anew = _anew(robot, parameters, to, source, recordings, cutoff, alone=bool(whole.callbacks))
    except InputError as error:
        return whole, [], f"{wanted}: {error}"
    without = set(parameters)
    names = {
        item.name
        for item in whole.left
        if any(p == item.name or p.startswith(f"{item.name}.") for p in without)
    }
    reason = f"in {CALLBACKS}" if to == "mjcf" else f"no place in {_FORMATS[to]}"
    left = [
        replace(item, reason=f"{reason}; fitted anew without it") for item in whole.left if item.name in names
    ]
    left += [item for item in anew.left if item.name not in names]
    return replace(anew, left=left), parameters, ""


def _anew(
    robot: _core.Robot,
    parameters: Sequence[str],
    to: Simulator,
    source: str | None,
    recordings: Sequence[Recorded],
    cutoff: float | None,
    alone: bool,
) -> _Written:
    """Fitted anew without these parameters, with laws of friction that stand in their place at joints where
    the format can hold those."""
    bare: set[str] = set()
    while True:
        fitted = refit.fit_without(robot, parameters, to, recordings, cutoff, bare)
        anew = _written(fitted, to, source, recordings, alone=alone)
        more = refit.joints_with(fitted, anew.lacking()) - bare
        if not more:
            return anew
        bare |= more


def _source_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a URDF: {error}") from None


def _callbacks_text(chain: Chain, model: mjcf.Model) -> str:
    """The source of `beside` with this robot's numbers."""
    text = inspect.getsource(beside)
    values: dict[str, tuple[str, Any]] = {
        "JOINTS": ("list[str]", [link.name for link in chain.driven]),
        "RATIOS": ("list[float]", [link.ratio for link in chain.driven]),
        "LINKS": ("list[str]", [link.name for link in chain.links]),
        "COUPLING": ("list[list[float]]", coupling_matrix(chain).tolist()),
        "EFFECTS": ("list[Effect]", model.beside),
        "FIELDS": ("dict[str, list[float]]", model.fields_beside),
    }
    for name, (kind, value) in values.items():
        empty = "{}" if kind.startswith("dict") else "[]"
        declaration = f"{name}: {kind} = {empty}\n"
        if declaration not in text:
            raise RuntimeError(f"the template of {CALLBACKS} lacks {declaration!r}")
        text = text.replace(declaration, f"{name}: {kind} = {value!r}\n")
    return text


def listed(
    robot: str,
    to: str,
    left: Sequence[NotWritten],
    where: str,
    refitted: Sequence[str] = (),
    not_refitted: str = "",
) -> str:
    """YAML of what was not written (JSON strings are YAML strings)."""
    lines = [
        f"robot: {json.dumps(robot)}",
        f"simulator: {to}",
        "# refitted: without these parameters Coulomb friction, damping and bodies were fitted anew",
        f"refitted: {json.dumps(list(refitted))}",
        *([f"not_refitted: {json.dumps(not_refitted)}"] if not_refitted else []),
        f"# size: root mean square over {where}; thermal effects 10 degrees and 600 s from where they count",
        "not_written:" + ("" if left else " []"),
    ]
    for item in left:
        lines.append(f"  - name: {json.dumps(item.name)}")
        size = "null" if math.isnan(item.size) else f"{item.size:.4g}"
        lines.append(f"    size_Nm: {size}")
        lines.append(f"    reason: {json.dumps(item.reason)}")
    return "\n".join(lines) + "\n"


def import_mujoco() -> Any:
    """Raises InputError where MuJoCo 4 is not installed."""
    try:
        import mujoco
    except ImportError:
        raise InputError("MuJoCo is not installed: pip install 'truing[dynamics]'") from None
    if int(mujoco.__version__.split(".")[0]) < 4:
        raise InputError(f"MuJoCo is {mujoco.__version__}, expected 4 or later: pip install -U mujoco")
    return mujoco


def _check(robot: _core.Robot, chain: Chain, reference: Reference, text: str) -> None:
    """Loads the model and holds it against the robot at ten poses. Raises RuntimeError."""
    mujoco = import_mujoco()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    base = np.linalg.inv(np.array(robot.T_measurement_base))
    site = model.site(robot.targets[0].name if robot.targets else "flange").id
    fitted = {"link_inertia", "payload"} & {effect.effect for effect in robot.torque_effects}
    for q, torque in zip(reference.q[::40], reference.torque[::40], strict=True):
        set_readings(chain, model, data, q)
        mujoco.mj_forward(model, data)
        pose = base @ np.array(_core.forward_kinematics(robot, q)[-1])
        if robot.targets and np.abs(data.site_xpos[site] - pose[:3, 3]).max() > _NEAR_M:
            raise RuntimeError(
                f"the written model's tool is at {data.site_xpos[site]}, the robot's at {pose[:3, 3]}"
            )
        if fitted or chain.adjusted:
            continue  # rigid_torques knows the bodies that the robot had before
        held = np.zeros(model.nv)
        mujoco.mj_rne(model, data, 0, held)
        found = coupling_matrix(chain).T @ held
        if np.abs(found - torque).max() > _NEAR_NM * (1.0 + np.abs(torque).max()):
            raise RuntimeError(f"the written model holds itself with {found} Nm, the robot with {torque} Nm")


def coupling_matrix(chain: Chain) -> NDArray[np.float64]:
    """Motion of every joint of the model for readings of one. shape=(links, driven)"""
    coupling = coupling_of([(link.name, link.drivers) for link in chain.links])
    driven = [k for k, link in enumerate(chain.links) if not link.drivers]
    return np.asarray(coupling[:, driven] * [link.ratio for link in chain.driven])


def set_readings(chain: Chain, model: Any, data: Any, q: NDArray[np.float64]) -> None:
    """Puts the model's joints where the robot's readings are."""
    for link, value in zip(chain.links, coupling_matrix(chain) @ q, strict=True):
        data.qpos[model.joint(link.name).qposadr[0]] = value
