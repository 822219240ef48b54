# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Models judged by motion: the right one moves like the robot, and a wrong one does not."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import truing
from truing.dynamics.export import export
from truing.dynamics.export.parts import drive_torque
from truing.dynamics.motion import track_of
from truing.dynamics.runner import Runner, runnable, runnable_mjcf
from truing.dynamics.simulate import judge, simulated_response, windows_of
from truing.model import AppliedEffect, Joint, Robot, Target

Floats = NDArray[np.float64]
COULOMB, VISCOUS, LOAD = (4.0, 2.0), (3.0, 1.0), (0.1, 0.0)


@dataclass
class Recording:
    name: str
    time: Floats
    position: Floats
    torque: Floats
    speed: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    current: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    columns: dict[str, Floats] = field(default_factory=dict)


def applied(effect: str, sizes: tuple[float, float]) -> AppliedEffect:
    return AppliedEffect(effect, ["J1", "J2"], {f"{effect}.J{k + 1}": size for k, size in enumerate(sizes)})


def two_links(*effects: AppliedEffect) -> Robot:
    joints = []
    for k, (mass, length) in enumerate(((5.0, 0.5), (3.0, 0.4))):
        T = np.eye(4)
        T[2, 3] = 0.5 * k
        joints.append(
            Joint(
                f"J{k + 1}",
                T_parent_joint=T,
                axis=[0.0, 1.0, 0.0],
                mass=mass,
                center_of_mass=[0.0, 0.0, length / 2],
                inertia=mass * length**2 / 12.0 * np.diag([1.0, 1.0, 0.05]),
                rotor_inertia=0.2,
                torque_per_ampere=10.0,
            )
        )
    return Robot("two links", joints=joints, convention="urdf", torque_effects=effects)


def move(seed: int, load: tuple[float, float], duration: float = 6.0, *, of_links: bool = False) -> Recording:
    table = moved(seed, load, duration, of_links)
    return Recording(f"motion {seed}", table[:, 0], table[:, 1:3].copy(), table[:, 3:].copy())


@functools.cache
def moved(seed: int, load: tuple[float, float], duration: float, of_links: bool) -> Floats:
    """The arm led by a controller, integrated in tenths of a millisecond: time, positions, torques, 200
    rows a second. of_links: friction grows with what the links take, else with what the motor gives."""
    model = pin.Model()
    parent = 0
    for joint in two_links().joints:
        parent = model.addJoint(
            parent, pin.JointModelRY(), pin.SE3(np.array(joint.T_parent_joint)), joint.name
        )
        inertia = pin.Inertia(joint.mass, np.array(joint.center_of_mass), np.array(joint.inertia))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    links = model.copy()
    model.armature = np.array([0.2, 0.2])
    data, of_the_links = model.createData(), links.createData()
    rng = np.random.default_rng(seed)
    w, phase = rng.uniform(1.0, 3.0, size=(2, 2)), rng.uniform(0.0, 6.0, size=(2, 2))
    h, q, qd, qdd, rows = 1e-4, np.zeros(2), np.zeros(2), np.zeros(2), []
    for k in range(int(duration / h)):
        t = k * h
        wanted = 0.5 * (np.sin(w * t + phase) - np.sin(phase)).sum(axis=1)
        rate = 0.5 * (w * np.cos(w * t + phase)).sum(axis=1)
        torque = 400.0 * (wanted - q) + 60.0 * (rate - qd) + pin.computeGeneralizedGravity(model, data, q)
        if k % 50 == 0:
            rows.append(np.concatenate([[t], q, torque]))
        carried = pin.rnea(links, of_the_links, q, qd, qdd) if of_links else torque
        dry = np.array(COULOMB) + np.array(load) * np.abs(carried)
        friction = dry * np.tanh(qd / 1e-3) + np.array(VISCOUS) * qd
        qdd = pin.aba(model, data, q, qd, torque - friction)
        qd = qd + h * qdd
        q = q + h * qd
    return np.array(rows)


STANDARD = (applied("coulomb", COULOMB), applied("viscous", VISCOUS))


def test_the_right_model_moves_like_the_robot() -> None:
    recordings = [move(seed, (0.0, 0.0)) for seed in (1, 2)]
    found = judge({"without friction": two_links(), "right": two_links(*STANDARD)}, recordings)
    assert found.worst_joint("right", 0.5) < 1e-3
    assert found.worst_joint("right", 0.1) < 2e-4
    assert found.worst_joint("without friction", 0.5) > 0.05
    assert 0.0 < found.step_error["right"] < 1e-3
    assert found.rms("right", 0.5).max() < 2e-3
    assert {row["model"] for row in found.rows()} == {"without friction", "right"}
    assert found.simulated["right"].shape == found.windows.measured.shape


def test_callbacks_add_what_the_file_cannot_say() -> None:
    recordings = [move(3, LOAD)]
    robot = two_links(*STANDARD, applied("load_friction", LOAD))
    with_them = judge({"named": robot}, recordings, horizons=(0.5,))
    without = judge({"named": robot}, recordings, horizons=(0.5,), callbacks=False)
    standard = judge({"standard": two_links(*STANDARD)}, recordings, horizons=(0.5,))
    assert with_them.worst_joint("named", 0.5) < 2e-3
    assert without.worst_joint("named", 0.5) > 2.0 * with_them.worst_joint("named", 0.5)
    assert standard.worst_joint("standard", 0.5) > without.worst_joint("named", 0.5)


def test_callbacks_know_what_the_links_take_of_a_torque() -> None:
    recordings = [move(4, (0.3, 0.2), of_links=True)]
    named, motor = (
        two_links(
            *STANDARD,
            AppliedEffect(
                "load_friction", ["J1", "J2"], {f"load_friction.J1{of}": 0.3, f"load_friction.J2{of}": 0.2}
            ),
        )
        for of in (".links", "")
    )
    found = judge({"links": named, "motor": motor}, recordings, horizons=(0.5,))
    assert found.worst_joint("links", 0.5) < 2e-3
    assert found.worst_joint("motor", 0.5) > 5.0 * found.worst_joint("links", 0.5)


def test_temperature_and_time_of_the_recording_reach_the_callbacks() -> None:
    # The friction that the motion was made with, told as what heat and running time have made of it.
    recording = move(2, (0.0, 0.0))
    recording.columns["temp_C"] = np.full(recording.time.size, 30.0)
    warm = AppliedEffect(
        "thermal_friction",
        ["J1", "J2"],
        {
            f"thermal_friction.J{k + 1}.{part}": sizes[k] / 10.0
            for part, sizes in (("coulomb", COULOMB), ("viscous", VISCOUS))
            for k in range(2)
        },
    )
    models = {"warm": two_links(warm), "right": two_links(*STANDARD)}
    found = judge(models, [recording], horizons=(0.5,))
    assert found.worst_joint("warm", 0.5) < 2e-3
    recording.columns["temp2_C"] = np.full(recording.time.size, 20.0)  # the second joint's own: it stays cold
    assert judge(models, [recording], horizons=(0.5,)).worst_joint("warm", 0.5) > 0.02
    late = AppliedEffect("warmup", ["J1"], {"warmup.J1.coulomb": 1.0})
    grows = judge({"late": two_links(*STANDARD, late)}, [recording], horizons=(0.5,)).errors("late", 0.5)
    assert np.abs(grows[-1]).max() > 3.0 * np.abs(grows[0]).max()


def test_ratios_and_zeros_change_nothing_but_the_readings() -> None:
    recording = move(1, (0.0, 0.0))
    ratio, zero = np.array([-1.25, 0.8]), np.array([0.1, -0.2])
    read = Recording("read", recording.time, (recording.position - zero) / ratio, recording.torque * ratio)
    plain = two_links(*STANDARD)
    joints = [
        joint.replace(ratio=ratio[k], offset=zero[k], rotor_inertia=0.2 * ratio[k] ** 2)
        for k, joint in enumerate(plain.joints)
    ]
    coulomb, viscous = np.array(COULOMB) * np.abs(ratio), np.array(VISCOUS) * ratio**2
    effects = [applied("coulomb", tuple(coulomb)), applied("viscous", tuple(viscous))]
    one = judge({"right": plain}, [recording], horizons=(0.5,))
    other = judge({"right": plain.replace(joints=joints, torque_effects=effects)}, [read], horizons=(0.5,))
    assert other.errors("right", 0.5) * ratio == pytest.approx(
        one.errors("right", 0.5), abs=2e-5
    )  # how far the friction solver goes


def test_recordings_say_what_stands_for_a_law_that_has_no_field(tmp_path: Path) -> None:
    recordings = [move(3, LOAD)]
    robot = two_links(*STANDARD, applied("load_friction", LOAD))
    exported = export(robot, "mjcf", tmp_path, recordings=recordings)
    torque = recordings[0].torque[:, 0]
    speed = np.abs(np.gradient(recordings[0].position[:, 0], recordings[0].time))
    load = LOAD[0] * np.abs(torque)
    columns = np.column_stack([np.ones_like(speed), speed])
    by_one, by_speed = np.linalg.lstsq(columns, load, rcond=None)[0]
    if by_speed < 0.0:
        by_one, by_speed = load.mean(), 0.0
    left = np.sqrt(np.mean((load - by_one - by_speed * speed) ** 2))
    (first, second) = exported.not_written
    assert (first.name, second.name) == ("load_friction.J1", "load_friction.J2")
    assert first.size == pytest.approx(left, rel=0.02)
    assert second.size == 0.0
    model = mujoco.MjModel.from_xml_path(str(exported.model))
    assert model.dof_frictionloss == pytest.approx([COULOMB[0] + by_one, COULOMB[1]], rel=0.02)
    assert model.dof_damping == pytest.approx([VISCOUS[0] + by_speed, VISCOUS[1]], rel=0.02)
    assert "over the recordings" in (tmp_path / "not_written.yaml").read_text(encoding="utf-8")


def test_a_written_folder_and_currents_do_as_well(tmp_path: Path) -> None:
    recording = move(1, (0.0, 0.0))
    currents = Recording("currents", recording.time, recording.position, np.zeros((0, 0)))
    currents.current = recording.torque / 10.0
    robot = two_links(*STANDARD)
    exported = export(robot, "mjcf", tmp_path)
    one = judge({"right": exported}, [currents], horizons=(0.5,))
    other = judge({"right": robot}, [recording], horizons=(0.5,))
    assert one.errors("right", 0.5) == pytest.approx(other.errors("right", 0.5), abs=1e-9)


def test_what_the_measurement_adds_is_taken_out_of_torques() -> None:
    time = np.arange(0.0, 5.0, 0.001)
    true = np.column_stack([np.sin(2.0 * time), np.cos(3.0 * time)])
    slope = np.column_stack([2.0 * np.cos(2.0 * time), -3.0 * np.sin(3.0 * time)])
    measured = true * [1.1, 1.0] - slope * [0.0, 0.004] + 0.002 * slope
    measured[:, 0] += 0.1 * 0.002 * slope[:, 0]  # the gain acts on what the clock shifted
    effects = (
        applied("motor_constant", (0.1, 0.0)),
        applied("torque_lag", (0.0, 0.004)),
        AppliedEffect("time_offset", [], {"time_offset": 0.002}),
    )
    at = np.arange(0.5, 4.5, 0.01)
    found = drive_torque(two_links(*effects), time, measured, at)
    assert found == pytest.approx(np.column_stack([np.sin(2.0 * at), np.cos(3.0 * at)]), abs=1e-4)


def test_windows_leave_gaps_out_and_say_what_is_missing() -> None:
    recording = move(1, (0.0, 0.0))
    kept = (recording.time < 1.5) | (recording.time > 1.8)
    gap = Recording("gap", recording.time[kept], recording.position[kept], recording.torque[kept])
    windows = windows_of([gap], two_links(), horizons=(0.5,), every=0.25)
    ends = windows.starts + 0.5
    assert len(windows.starts) > 4
    assert not np.any((windows.starts < 1.8) & (ends > 1.5))
    track = track_of(gap, two_links(), 0.05)[0]
    ((_, end), (begin, _)) = track.stretches
    assert np.array_equal(track.near_gap(0.1), (track.time > end - 0.1) & (track.time < begin + 0.1))
    with pytest.raises(truing.InputError, match="no recording has 10.1 s without a gap"):
        windows_of([recording], two_links(), horizons=(10.0,))
    nothing = Recording("nothing", recording.time, recording.position, np.zeros((0, 0)))
    with pytest.raises(truing.InputError, match="nothing: no torques, and no currents"):
        windows_of([nothing], two_links())
    with pytest.raises(truing.InputError, match="was not judged: models right, horizons 0.5 s"):
        judge({"right": two_links(*STANDARD)}, [recording], horizons=(0.5,)).errors("right", 0.1)


def test_a_clock_that_jumped_takes_neither_time_nor_memory() -> None:
    recording = move(1, (0.0, 0.0))
    later = recording.time + np.where(recording.time > 3.0, 1e8, 0.0)
    jumped = Recording("jumped", later, recording.position, recording.torque)
    windows = windows_of([jumped], two_links(), horizons=(0.5,), every=0.25)
    assert windows.tracks[0].time.size == recording.time.size
    plain = windows_of([recording], two_links(), horizons=(0.5,), every=0.25)
    assert 0.7 * plain.starts.size < windows.starts.size < plain.starts.size
    single = Recording("single", later[:1], recording.position[:1], recording.torque[:1])
    with pytest.raises(truing.InputError, match="single: 0 s are too short to be simulated"):
        windows_of([single], two_links())


MJCF = """<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/>
<worldbody><body>
<joint name="J1" axis="0 1 0" ref="0.3" armature="0.2" damping="3" frictionloss="4" solreffriction="0.004 1"/>
<inertial pos="0 0 0.25" mass="5" diaginertia="0.10416666666666667 0.10416666666666667 0.005208333333333333"/>
<body pos="0 0 0.5"><joint name="J2" axis="0 1 0" armature="0.2" damping="1" frictionloss="2"
 solreffriction="0.004 1"/>
<inertial pos="0 0 0.2" mass="3" diaginertia="0.04 0.04 0.002"/></body></body></worldbody>
<actuator>{}</actuator></mujoco>"""


def an_mjcf(folder: Path, actuators: str = "") -> Path:
    """The arm that the recordings were made with, its first joint counted from 0.3 rad."""
    path = folder / "own.xml"
    path.write_text(MJCF.format(actuators), encoding="utf-8")
    return path


def test_an_mjcf_runs_as_it_is_and_its_drives_give_way(tmp_path: Path) -> None:
    recording = move(1, (0.0, 0.0))
    recording.position[:, 0] += 0.3  # its readings count from ref
    path = an_mjcf(tmp_path, '<position name="servo" joint="J1" kp="500"/><motor name="plain" joint="J2"/>')
    own = runnable_mjcf(path, truing.load_robot(path))
    assert own.notes == ("recorded torques stand in the place of its drives servo",)
    found = judge({"own": own}, [recording], horizons=(0.1, 0.5), torques=True)
    assert found.worst_joint("own", 0.5) < 2e-3
    assert np.all(found.torque_error["own"] < 0.03 * found.torque_spread["own"])


def test_torques_of_a_motion_are_those_that_make_it(tmp_path: Path) -> None:
    # Against the core's rigid torques, and the laws by hand: bristles, ripple, friction of the callbacks.
    recording = move(3, LOAD)
    bristles = {
        "presliding.J1": 3.0,
        "presliding.J1.x0": 1e-3,
        "presliding.J2": 1.0,
        "presliding.J2.x0": 1e-3,
    }
    presliding = AppliedEffect("presliding", ["J1", "J2"], bristles)
    ripple = AppliedEffect("ripple", ["J1"], {"ripple.J1.sin3": 2.0, "ripple.J1.cos3": 1.0})
    robot = two_links(*STANDARD, presliding, ripple, applied("load_friction", LOAD))
    model = runnable(export(robot, "mjcf", tmp_path))
    track, _ = track_of(recording, robot, 0.05)
    runner = Runner(model, [track])
    rows = np.arange(0, track.time.size, 7)
    found = runner.torques(0, rows)
    rigid = truing._core.rigid_torques(robot, track.q[rows], track.qd[rows], track.qdd[rows])
    drive = drive_torque(robot, track.torque_time, track.torque, track.time[rows])
    speed = track.qd[rows]
    dry = (np.array(COULOMB) + np.array(LOAD) * np.abs(drive)) * np.sign(speed)
    bent = np.array([3.0, 1.0]) * runner.bristles[0][rows] / 1e-3
    wave = np.outer(2.0 * np.sin(3.0 * track.q[rows, 0]) + np.cos(3.0 * track.q[rows, 0]), [1.0, 0.0])
    expected = rigid + np.array(VISCOUS) * speed + dry + bent + wave
    fast = np.all(np.abs(speed) > 0.3, axis=1)  # where the bristles are bent to the end, and friction is full
    assert fast.sum() > 30
    assert found[fast] == pytest.approx(expected[fast], abs=0.05)


def test_a_response_has_every_row_and_begins_anew_at_measured_states() -> None:
    recording = move(1, (0.0, 0.0))
    kept = (recording.time < 2.0) | (recording.time > 2.2)
    gap = Recording("gap", recording.time[kept], recording.position[kept], recording.torque[kept])
    found = simulated_response(two_links(*STANDARD), gap, 0.5)
    assert found.position.shape == gap.position.shape
    assert found.start[4] == gap.time[gap.time > 2.2][0]  # after the gap, before the fourth window was over
    for number, start in enumerate(found.start):
        rows = found.window == number
        assert np.all((gap.time[rows] >= start - 1e-9) & (gap.time[rows] < start + 0.5))
        assert found.position[rows][0] == pytest.approx(gap.position[rows][0], abs=1e-3)
    later = found.window > 0  # the controller began with a jerk, which the smoothing cannot follow
    assert np.abs(found.position - gap.position)[later].max() < 0.01
    assert np.abs(simulated_response(two_links(), gap, 0.5).position - gap.position).max() > 0.05
    with pytest.raises(truing.InputError, match="a horizon of 0 s"):
        simulated_response(two_links(), gap, 0.0)


# ---- Known payloads: a point mass at the tool, as the torque half has it ---------------------------------

PLACE = (0.02, -0.05, 0.1)  # [m] of the payload in the tool's frame


def with_a_tool(robot: Robot) -> Robot:
    """Beside the last frame, and turned."""
    T = np.eye(4)
    T[:3, 3] = [0.03, 0.02, 0.4]
    T[:3, :3] = [[0.0, -1.0, 0.0], [0.8, 0.0, -0.6], [0.6, 0.0, 0.8]]
    return robot.replace(targets=[Target("tool", T)])


def loaded(recording: Recording, mass: Floats) -> Recording:
    columns = {"payload_kg": mass} | {
        f"payload_{axis}_m": np.full(mass.size, value) for axis, value in zip("xyz", PLACE, strict=True)
    }
    return Recording(recording.name, recording.time, recording.position, recording.torque, columns=columns)


def link_of_dh(robot: Robot) -> Robot:
    """An arm whose bodies do not stand in their joints' frames."""
    joints = [
        Joint(
            joint.name,
            theta=0.3 * k,
            d=0.1,
            a=0.5,
            alpha=0.4 - k,
            mass=joint.mass,
            center_of_mass=[-0.2, 0.03, 0.01],
            inertia=joint.inertia,
        )
        for k, joint in enumerate(robot.joints)
    ]
    return Robot("dh", joints=joints, convention="dh", gravity=[1.0, -2.0, -9.0])


@pytest.mark.parametrize("convention", ["urdf", "dh", "mjcf"])
def test_a_payload_weighs_in_simulations_as_it_does_in_torques(convention: str, tmp_path: Path) -> None:
    recording = move(1, (0.0, 0.0))
    recording = loaded(recording, np.where(recording.time < 2.0, 0.0, 1.5))
    if convention == "mjcf":
        # The last joint turns about a point beside its body's frame, and the site is turned against it.
        path = tmp_path / "arm.xml"
        path.write_text(
            """<mujoco><worldbody><body><joint name="J1" axis="0 1 0"/>
<inertial pos="0 0 0.2" mass="5" diaginertia="0.1 0.1 0.01"/><body pos="0 0 0.5" euler="10 20 30">
<joint name="J2" axis="0 1 0" pos="0.02 0.1 0.03"/>
<inertial pos="0 0 0.2" mass="3" diaginertia="0.04 0.04 0.002"/>
<site name="tool" pos="0.1 0 0.3" euler="40 10 0"/></body></body></worldbody></mujoco>""",
            encoding="utf-8",
        )
        robot = truing.load_robot(path)
        model = runnable_mjcf(path, robot)
    else:
        robot = with_a_tool(two_links() if convention == "urdf" else link_of_dh(two_links()))
        model = runnable(export(robot, "mjcf", tmp_path))
    track, _ = track_of(recording, robot, 0.05)
    rows = np.arange(0, track.time.size, 40)
    found = Runner(model, [track]).torques(0, rows)
    grown = robot.copy()
    T = np.array(robot.targets[0].T_last_target)
    place = (T @ [*PLACE, 1.0])[:3]
    last = grown.joints[-1]
    assert last.mass is not None and last.center_of_mass is not None and last.inertia is not None
    apart = place - np.array(last.center_of_mass)
    reduced = last.mass * 1.5 / (last.mass + 1.5)
    last.inertia = np.array(last.inertia) + reduced * (apart @ apart * np.eye(3) - np.outer(apart, apart))
    last.center_of_mass = np.array(last.center_of_mass) + 1.5 / (last.mass + 1.5) * apart
    last.mass += 1.5
    motion = track.q[rows], track.qd[rows], track.qdd[rows]
    bare, heavy = (np.asarray(truing._core.rigid_torques(one, *motion)) for one in (robot, grown))
    carries = (track.time[rows] > 1.9999)[:, None]
    assert found == pytest.approx(np.where(carries, heavy, bare), abs=1e-6)
    assert np.abs(heavy - bare).max() > 1.0


def test_windows_run_with_the_payload_that_they_begin_with(tmp_path: Path) -> None:
    recording = move(1, (0.0, 0.0))
    robot = with_a_tool(two_links(*STANDARD))
    everywhere = loaded(recording, np.full(recording.time.size, 1.5))
    later = loaded(recording, np.where(recording.time < 3.0, 0.0, 1.5))
    with_it = judge({"arm": robot}, [everywhere], horizons=(0.5,))
    without = judge({"arm": robot}, [recording], horizons=(0.5,))
    both = judge({"arm": robot}, [later], horizons=(0.5,))
    starts = both.windows.starts
    assert not np.any((starts < 3.0) & (starts + 0.5 >= 3.0))  # none in which it changes
    for found, rows in ((without, starts < 3.0), (with_it, starts > 3.0)):
        same = np.searchsorted(found.windows.starts, starts[rows])
        assert both.errors("arm", 0.5)[rows] == pytest.approx(found.errors("arm", 0.5)[same], abs=1e-12)
    assert with_it.worst_joint("arm", 0.5) > 3.0 * without.worst_joint("arm", 0.5)
    response = simulated_response(robot, later, 0.8)
    assert np.any(np.abs(response.start - 3.0) < 0.006)  # begun anew where the payload came
    exported = export(robot, "mjcf", tmp_path)
    assert mujoco.MjModel.from_xml_path(str(exported.model)).body("J2_link").mass == pytest.approx(3.0)
