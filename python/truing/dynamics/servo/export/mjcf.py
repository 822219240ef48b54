# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A servo arm as MJCF: the file that it came from, with its joints, actuators and masses as they were found.

Elements of MuJoCo 4, written by MjSpec (six digits):

- gain, damping gain, integral, rate limit: `position` or, with the latter two, `pid` (slewmax, ki).
- delay: `delay` with `interp` linear: of commands held from step to step that is their mean over a step, as
  the chain takes it.
- saturation: forcerange. Zero of the recordings: `ref` of the joint, so that qpos is what the robot reads.
- dry friction with solreffriction and solimpfriction, or it creeps; presliding and Stribeck friction: a
  passive `dcmotor` with LuGre, as in truing.dynamics.export.mjcf. A constant torque: cogging with no poles.
- play and elasticity between rotor and link: a further hinge behind the joint, with limits or a spring.
- weight: gravcomp of the bodies. Weight at single joints: those gravcomp that are nearest to it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.export import import_mujoco
from truing.dynamics.export.mjcf import FRICTION_HOLDS, FRICTION_TIME
from truing.dynamics.export.parts import NotWritten
from truing.dynamics.servo.chain import ServoChain
from truing.dynamics.servo.export.held import Held, HeldJoint, Use
from truing.errors import InputError
from truing.files.mjcf_file import quiet

Floats = NDArray[np.float64]

_BRISTLE = 1e-3  # [rad | m] over which a Stribeck friction without presliding builds up
_POINT = 1e-9  # [kg m^2] inertia of a payload that is a point
_POSTURES = 60  # of the recordings, or drawn, on which bodies' weights are fitted
_SOFT = 0.03  # ridge of that fit towards the file's weights, over the mean square of its columns
_DIGITS = 2e-5  # relative: what six digits leave of a value
_STEPS_AT_LEAST = 2.0  # of the simulator's in the time in which dry friction holds (MuJoCo's manual)


def write(
    chain: ServoChain, held: Held, uses: dict[str, Use], source: Path | str
) -> tuple[str, list[NotWritten]]:
    """The text of the MJCF, and what it lacks.

    source: MJCF or URDF file that was diagnosed, whose meshes, sites and other joints stay, or the text of
    one. Raises InputError: MuJoCo does not take the source, or it has not the chain's joints and bodies.
    """
    mujoco = import_mujoco()
    spec = _spec(mujoco, source)
    left = list(held.not_written)
    _check_names(spec, chain, source)
    most = FRICTION_TIME / _STEPS_AT_LEAST
    spec.option.timestep = min(float(spec.option.timestep), most)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    _place_masses(mujoco, spec, chain, left)
    if chain.gravity is not None:
        spec.option.gravity = list(chain.gravity)
    _place_weights(mujoco, spec, chain, uses, left)
    for joint, values in held.joints.items():
        actuator = _actuator(mujoco, spec, joint)
        _write_joint(mujoco, spec, joint, values)
        _write_actuator(mujoco, spec, actuator, values)
        _write_passive(mujoco, spec, joint, values)
    _shift_keys(mujoco, spec, held)
    try:
        spec.compile()
        text = str(spec.to_xml())
        _check(mujoco, text, held)
    except ValueError as error:
        raise InputError(f"the model as written is not taken by MuJoCo: {error}") from None
    return text, left


def _spec(mujoco: Any, source: Path | str) -> Any:
    name = str(source) if isinstance(source, Path) else "the result's model"
    try:
        if isinstance(source, Path):
            with quiet(mujoco):
                spec = mujoco.MjSpec.from_file(str(source))
            for folder in ("meshdir", "texturedir"):  # the file moves, what it names does not
                if spec.meshes or spec.textures:
                    setattr(spec, folder, str((source.parent / getattr(spec, folder)).resolve()))
            with quiet(mujoco):
                spec.copy().compile()
        else:
            spec = mujoco.MjSpec.from_string(source)
    except ValueError as error:
        raise InputError(f"{name}: MuJoCo {mujoco.__version__} does not take it: {error}") from None
    return spec


def _check_names(spec: Any, chain: ServoChain, source: Path | str) -> None:
    joints = [joint.name for joint in spec.joints]
    missing = [name for name in chain.joints if name not in joints]
    if missing:
        where = source if isinstance(source, Path) else "the result's model"
        raise InputError(f"{where}: has no joint {missing[0]}; its joints are {', '.join(joints)}")


# ---- Masses and weights ------------------------------------------------------------------------------
def _place_masses(mujoco: Any, spec: Any, chain: ServoChain, left: list[NotWritten]) -> None:
    model = spec.copy().compile()
    for name, scale in chain.link_scale.items():
        body = spec.body(name)
        if body is None:
            left.append(NotWritten(f"link_scale.{name}", math.nan, "the source has no such body"))
            continue
        b = model.body(name).id
        _set_inertial(body, float(model.body_mass[b]) * scale, model, b, scale)
    if chain.payload_mass > 0.0:
        body = spec.body(chain.payload_body)
        if body is None:
            left.append(NotWritten("payload", math.nan, f"the source has no body {chain.payload_body}"))
            return
        added = body.add_body(name=_free_name(spec.bodies, "payload"), pos=list(chain.payload_place))
        added.explicitinertial = True
        added.mass, added.inertia = chain.payload_mass, [_POINT] * 3
        added.ipos, added.iquat = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
    elif chain.payload_mass < 0.0:
        left.append(NotWritten("payload", math.nan, "negative: a body of less than nothing cannot be added"))


def _set_inertial(body: Any, mass: float, model: Any, b: int, scale: float) -> None:
    body.explicitinertial, body.mass = True, mass
    body.ipos, body.iquat = model.body_ipos[b], model.body_iquat[b]
    body.fullinertia = [math.nan] * 6  # the principal moments are stated instead
    body.inertia = model.body_inertia[b] * scale


def _free_name(elements: Any, name: str) -> str:
    taken = {element.name for element in elements}
    return name if name not in taken else _free_name(elements, name + "_")


def _place_weights(
    mujoco: Any, spec: Any, chain: ServoChain, uses: dict[str, Use], left: list[NotWritten]
) -> None:
    """Weights of the bodies by gravcomp, 1 - g' = w (1 - g): all alike, or nearest to weights at joints."""
    at_joints = np.array([drive.gravity_scale for drive in chain.drives])
    moving = _moving(spec, chain)
    if np.allclose(at_joints, at_joints[0]):
        factors = np.full(len(moving), chain.weight_scale * at_joints[0])
    else:
        factors, rest = _nearest_weights(mujoco, spec, chain, uses, moving, at_joints)
        factors = factors * chain.weight_scale
        for name, size, scale in zip(chain.joints, rest, at_joints, strict=True):
            if scale != 1.0:
                reason = "MuJoCo weighs bodies, not joints: the bodies' weights are the nearest to it"
                left.append(NotWritten(f"gravity_scale.{name}", float(size), reason))
    for body, factor in zip(moving, factors, strict=True):
        body.gravcomp = round(1.0 - factor * (1.0 - float(body.gravcomp)), 9)
    compensated = [float(body.gravcomp) for body in spec.bodies[1:]]
    if min(compensated) < 0.0 and max(compensated) <= 0.0:
        # MuJoCo heeds negative ones (more weight) only where some body has a positive one: it may be empty.
        spec.worldbody.add_body(name=_free_name(spec.bodies, "more_weight"), gravcomp=1.0)


def _moving(spec: Any, chain: ServoChain) -> list[Any]:
    """Bodies that move with the chain's joints, and have a mass."""
    model = spec.copy().compile()
    with_joint = {int(model.jnt_bodyid[model.joint(name).id]) for name in chain.joints}
    out = []
    for b in range(1, model.nbody):
        at = b
        while at and at not in with_joint:
            at = int(model.body_parentid[at])
        if at and model.body_mass[b] > 0.0:
            out.append(spec.body(model.body(b).name))
    return out


def _nearest_weights(
    mujoco: Any, spec: Any, chain: ServoChain, uses: dict[str, Use], moving: list[Any], at_joints: Floats
) -> tuple[Floats, Floats]:
    """Factors of the bodies' weights whose torques are nearest to those of the joints', by least squares over
    postures that were recorded (else drawn from the joints' ranges); and what is left of each joint [Nm]."""
    model = spec.copy().compile()
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in chain.joints]
    dofs = [int(joint.dofadr[0]) for joint in joints]
    names = [body.name for body in moving]
    columns, wanted = [], []
    for posture in _postures(chain, uses, model, joints):
        for joint, value in zip(joints, posture, strict=True):
            data.qpos[joint.qposadr[0]] = value
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        table = np.empty((len(dofs), len(names)))
        jacobian = np.empty((3, model.nv))
        for k, name in enumerate(names):
            b = model.body(name).id
            mujoco.mj_jacBodyCom(model, data, jacobian, None, b)
            weight = model.body_mass[b] * (1.0 - model.body_gravcomp[b])
            table[:, k] = weight * (np.array(model.opt.gravity) @ jacobian)[dofs]
        columns.append(table)
        wanted.append(at_joints * table.sum(axis=1))
    x, y = np.concatenate(columns), np.concatenate(wanted)
    ridge = math.sqrt(_SOFT * float(np.mean(x**2)) * len(x))
    whole = np.vstack([x, ridge * np.eye(len(names))])
    found = np.linalg.lstsq(whole, np.concatenate([y, np.full(len(names), ridge)]), rcond=None)[0]
    rest = (x @ found - y).reshape(-1, len(dofs))
    return found, np.sqrt(np.mean(rest**2, axis=0))


def _postures(chain: ServoChain, uses: dict[str, Use], model: Any, joints: list[Any]) -> Floats:
    """shape=(n, joints) [rad | m] of the model's joints."""
    angles = [uses[name].angle for name in chain.joints]
    if all(angle.size for angle in angles):
        rows = np.unique(np.linspace(0, angles[0].size - 1, _POSTURES).astype(int))
        zeros = np.array([drive.zero for drive in chain.drives])
        return np.asarray(np.column_stack([angle[rows] for angle in angles]) - zeros)
    random = np.random.default_rng(0)
    ranges = np.array([model.jnt_range[j.id] if model.jnt_limited[j.id] else (-1.5, 1.5) for j in joints])
    return np.asarray(random.uniform(ranges[:, 0], ranges[:, 1], size=(_POSTURES, len(joints))))


# ---- Joints ------------------------------------------------------------------------------------------
def _write_joint(mujoco: Any, spec: Any, name: str, values: HeldJoint) -> None:
    joint = spec.joint(name)
    bristles = values.presliding > 0.0 or values.more_at_rest != 0.0
    joint.damping = _as_field(joint.damping, values.damping)
    joint.frictionloss = 0.0 if bristles else values.friction
    joint.solref_friction = [FRICTION_TIME, 1.0]
    joint.solimp_friction[: len(FRICTION_HOLDS)] = FRICTION_HOLDS
    joint.armature = values.armature
    before, at = float(np.ravel(joint.stiffness)[0]), float(joint.springref)
    joint.stiffness = _as_field(joint.stiffness, (before + values.spring,))
    if before + values.spring:  # two springs are one between them; the chain's rests at the model's zero
        joint.springref = before * at / (before + values.spring) + values.zero
    elif at:
        joint.springref = at + values.zero
    joint.ref = float(joint.ref) + values.zero
    if joint.range[0] < joint.range[1]:
        joint.range = [float(end) + values.zero for end in joint.range]
    if values.play or values.twist:
        _add_play(mujoco, spec, joint, values)


def _as_field(before: Any, values: tuple[float, ...]) -> Any:
    """A polynomial's coefficients, as long as the field has room for."""
    n = np.ravel(before).size
    return float(values[0]) if np.ndim(before) == 0 else [*values, *([0.0] * n)][:n]


def _add_play(mujoco: Any, spec: Any, joint: Any, values: HeldJoint) -> None:
    """A hinge behind the joint: what the joint carries turns against its rotor."""
    body = joint.parent
    play = body.add_joint(
        name=_free_name(spec.joints, f"{joint.name}_play"), type=joint.type, axis=joint.axis, pos=joint.pos
    )
    # Hard enough to be stops beside the rotor, and soft enough for the step.
    rub = 2.0 * 0.1 * math.sqrt(values.armature / values.twist) if values.twist else 0.0
    play.damping = _as_field(play.damping, (rub,))
    if values.twist:
        play.stiffness = _as_field(play.stiffness, (1.0 / values.twist,))
    if values.play:
        play.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        play.range = [-0.5 * values.play, 0.5 * values.play]
        play.solref_limit = [FRICTION_TIME, 1.0]
    play.armature = 0.02 * values.armature


def _shift_keys(mujoco: Any, spec: Any, held: Held) -> None:
    """Keyframes hold what joints read, and actuators are commanded: both as recorded now."""
    if not spec.keys:
        return
    model = spec.copy().compile()
    for key in spec.keys:
        for name, values in held.joints.items():
            adr = int(model.joint(name).qposadr[0])
            if len(key.qpos) > adr:
                key.qpos[adr] += values.zero
            actuator = int(model.joint(name).id)
            for i in range(model.actuator_ctrlnum.size):
                at = int(model.actuator_ctrladr[i])
                if int(model.actuator_trnid[i, 0]) == actuator and len(key.ctrl) > at >= 0:
                    key.ctrl[at] += values.zero


# ---- Actuators ---------------------------------------------------------------------------------------
def _actuator(mujoco: Any, spec: Any, joint: str) -> Any:
    """The joint's actuator, which keeps its name and place; a new one if it has none."""
    kinds = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    there = [a for a in spec.actuators if a.trntype in kinds and a.target == joint]
    if there:
        return there[0]
    return spec.add_actuator(
        name=_free_name(spec.actuators, joint), target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT
    )


def _write_actuator(mujoco: Any, spec: Any, actuator: Any, values: HeldJoint) -> None:
    gear = float(actuator.gear[0]) or 1.0
    if values.integral_gain or values.rate_limit:
        more: dict[str, float] = {}
        if values.integral_gain:
            more["ki"] = values.integral_gain
        if values.rate_limit:
            more["slewmax"] = values.rate_limit
        position_only = int(mujoco.mjtCtrlInput.mjINPUT_POS)
        actuator.set_to_pid(kp=values.gain, kv=values.damping_gain, ctrlspec=position_only, **more)
    else:
        actuator.set_to_position(kp=values.gain, kv=values.damping_gain)
    actuator.gear = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    actuator.damping, actuator.armature = _as_field(actuator.damping, (0.0,)), 0.0
    low, high = (float(end) / gear + values.zero for end in actuator.ctrlrange)
    if low < high:
        actuator.ctrlrange = [low, high]
    limited = mujoco.mjtLimited
    actuator.forcelimited = limited.mjLIMITED_TRUE if values.force_limit else limited.mjLIMITED_FALSE
    most = values.force_limit or 0.0
    actuator.forcerange = [-most, most]
    step = float(spec.option.timestep)
    late = values.delay > 1e-6
    actuator.delay = values.delay if late else 0.0
    actuator.nsample = math.ceil(values.delay / step) + 2 if late else 0
    actuator.interp = 1 if late else 0  # linear


def _write_passive(mujoco: Any, spec: Any, joint: str, values: HeldJoint) -> None:
    """Friction with a bristle, and a constant torque: a `dcmotor` without input or current."""
    none = int(mujoco.mjtCtrlInput.mjINPUT_NONE)
    target = {"target": joint, "trntype": mujoco.mjtTrn.mjTRN_JOINT}
    if values.presliding > 0.0 or values.more_at_rest != 0.0:
        level = max(values.friction, 1e-9)
        still = max(level + values.more_at_rest, 1e-9)
        bristle = spec.add_actuator(name=_free_name(spec.actuators, f"friction_{joint}"), **target)
        stiffness = level / (values.presliding or _BRISTLE)
        lugre = [stiffness, 0.0, level, still, values.stribeck_speed]
        bristle.set_to_dcmotor(motorconst=[0.0, 0.0], resistance=1.0, lugre=lugre, ctrlspec=none)
    if values.offset:
        constant = spec.add_actuator(name=_free_name(spec.actuators, f"torque_{joint}"), **target)
        cogging = [values.offset, 0.0, math.pi / 2]
        constant.set_to_dcmotor(motorconst=[0.0, 0.0], resistance=1.0, cogging=cogging, ctrlspec=none)


def _check(mujoco: Any, text: str, held: Held) -> None:
    """Loads the text again and holds its joints against what was to be written. Raises RuntimeError."""
    model = mujoco.MjModel.from_xml_string(text)
    for name, values in held.joints.items():
        joint = model.joint(name)
        dof = int(joint.dofadr[0])
        mine = [
            i
            for i in range(model.actuator_ctrlnum.size)
            if int(model.actuator_trnid[i, 0]) == int(joint.id) and model.actuator_ctrlnum[i]
        ]
        found = {
            "armature": (float(model.dof_armature[dof]), values.armature),
            "damping": (float(np.ravel(model.dof_damping[dof])[0]), values.damping[0]),
            "ref": (float(model.qpos0[joint.qposadr[0]]), None),
            "gain": (-float(model.actuator_biasprm[mine[0], 1]), values.gain),
            "delay": (float(model.actuator_delay[mine[0]]), values.delay if values.delay > 1e-6 else 0.0),
        }
        for what, (is_, wanted) in found.items():
            if wanted is not None and abs(is_ - wanted) > _DIGITS * abs(wanted) + 1e-12:
                raise RuntimeError(f"the written model's {what} of {name} is {is_}, expected {wanted}")
