# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Configuration data as the makers count them, at joints for which manuals and public programs say them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from program_corpus import options
from program_robots import built, nominal
from truing.files.brand_frames import NOTATIONS, Brand, numbers_from_frame
from truing.files.programs import Configuration
from truing.inverse_kinematics import InverseSolver
from truing.model import AppliedEffect
from truing.programs import ApplyOptions, apply_programs
from truing.programs.configuration import after_move, fits, posture_of


def posture(brand: Brand, degrees: list[float]):  # type: ignore[no-untyped-def]
    solver = InverseSolver(nominal(brand))
    return posture_of(solver.forward, np.radians(degrees))


@pytest.mark.parametrize(
    ("brand", "degrees", "values"),
    [
        # KUKA: forearm bent forward and down is S 2; a negative A5 adds 4, behind axis 1 adds 1.
        ("kuka", [10, -90, 90, 5, 30, 7], (2, 0b000010)),
        ("kuka", [-10, -90, 90, -5, -30, -7], (6, 0b111011)),
        ("kuka", [10, -150, -30, 5, 30, 7], (1, 0b000110)),
        # RoboDK's IRB 1200 has [0,0,-1,1] at 0 -3.69 -0.70 0 -56.11 0 (cf6: 0 or -1, at the edge).
        ("abb", [0, -3.687, -0.703, 0, -56.115, 0], (0, 0, -1, 1)),
        ("abb", [95, 10, 15, -100, 50, 200], (1, -2, 2, 0)),
        # FANUC's usual N U T: tool down, J5 negative.
        ("fanuc", [0, 10, 0, 0, -60, 0], (0, 1, 1, 0, 0, 0)),
        ("fanuc", [0, 10, 0, 0, 60, 200], (1, 1, 1, 0, 0, 1)),
        # Yaskawa: flip (0) while R is within 90 degrees.
        ("yaskawa", [0, 10, 0, 30, -60, 0], (0, 0, 0, 0, 0, 0)),
        ("yaskawa", [0, 10, 0, 150, 60, -190], (1, 0, 0, 0, 1, 0)),
        # Behind axis 1: the lower arm lies back, the forearm stands up on its end. The wrist is before the
        # lower arm as ever (ABB), but the elbow is under the line from shoulder to wrist (FANUC, Yaskawa).
        ("abb", [10, -90, 0, 5, 30, 7], (0, 0, 0, 4)),
        ("abb", [-10, -90, 0, 5, -30, 7], (-1, 0, 0, 5)),
        ("fanuc", [0, -90, 0, 0, 60, 0], (1, 0, 0, 0, 0, 0)),
        ("yaskawa", [0, -90, 0, 30, 60, 0], (0, 1, 1, 0, 0, 0)),
        # The forearm folded over further: the elbow is above that line.
        ("fanuc", [0, -45, 150, 0, 60, 0], (1, 1, 0, 0, 0, 0)),
    ],
)
def test_configuration_data_are_those_of_the_joints(
    brand: Brand, degrees: list[float], values: tuple[int, ...]
) -> None:
    at = posture(brand, degrees)
    assert fits(Configuration(brand, values, ""), at)
    flags = {"kuka": [0], "abb": [3], "fanuc": [0, 1, 2], "yaskawa": [0, 1, 2]}[brand]
    for index in flags:  # every bit of them decides
        for bit in (1, 2, 4) if brand in ("kuka", "abb") else (1,):
            other = tuple(v ^ bit if k == index else v for k, v in enumerate(values))
            assert not fits(Configuration(brand, other, ""), at)


def test_axes_that_do_not_meet_have_no_such_configuration() -> None:
    assert posture("abb", [0, 10, 15, 0, 50, 0]).meets < 1e-9
    robot = nominal("abb")
    T = np.array(robot.joints[4].T_parent_joint)
    T[1, 3] = 0.05
    robot.joints[4].T_parent_joint = T
    assert posture_of(InverseSolver(robot).forward, np.radians([0, 10, 15, 0, 50, 0])).meets > 0.02


def test_a_wrist_that_would_turn_over_is_said() -> None:
    """A5 passes zero: another S, which no correction may bring about."""
    configuration = Configuration("kuka", (2, 2), "S 2, T 2")
    assert after_move(configuration, posture("kuka", [10, -90, 90, 5, 0.5, 7])) == {}
    over = after_move(configuration, posture("kuka", [10, -90, 90, 5, -0.5, 7]))
    assert isinstance(over, str) and "S bit 2" in over


def test_what_sags_under_load_is_lifted_by_the_payload_that_is_said(tmp_path: Path) -> None:
    """A spring at J2 gives way to 10 kg: with --payload the target is met, without it is not."""
    believed, real = nominal("fanuc"), nominal("fanuc")
    for robot in (believed, real):
        for joint in robot.joints[:6]:
            joint.mass = 10.0
    real.effects = [
        AppliedEffect("joint_compliance", joints=["J2"], parameters={"joint_compliance.J2": 2e-6})
    ]
    numbers = numbers_from_frame("fanuc", InverseSolver(believed).forward(np.radians([0, 10, 0, 0, -60, 0])))
    named = ", ".join(
        f"{n} = {v:.3f} {'mm' if n in 'XYZ' else 'deg'}"
        for n, v in zip(NOTATIONS["fanuc"].names, numbers, strict=True)
    )
    path = tmp_path / "load.ls"
    path.write_text(
        "/PROG L\n/MN\n 1:L P[1] 9mm/sec FINE ;\n/POS\nP[1]{\n GP1:\n UF : 0, UT : 0,"
        f" CONFIG : 'N U T, 0, 0, 0',\n {named}\n}};\n/END\n"
    )
    light, loaded = (
        apply_programs([path], believed, real, ApplyOptions(payload=mass)).targets[0] for mass in (0.0, 10.0)
    )
    assert loaded.before[0] > light.before[0] + 1e-5
    assert loaded.after[0] < 1e-5 and light.after[0] < 1e-5
    assert loaded.command is not None and light.command is not None
    assert loaded.command[2, 3] > light.command[2, 3] > 0  # lifted by more


def test_the_seed_says_where_the_robot_comes_from(tmp_path: Path) -> None:
    path = tmp_path / "first.script"
    solver = InverseSolver(nominal("ur"))
    q = np.radians([-20.0, -80.0, 95.0, -100.0, -85.0, 30.0])
    numbers = ", ".join(f"{value:.6f}" for value in numbers_from_frame("ur", solver.forward(q)))
    path.write_text(f"def p():\n  set_tcp(p[0,0,0,0,0,0])\n  movel(p[{numbers}])\nend\n")
    without = apply_programs([path], nominal("ur"), built("ur"), options("ur"))
    assert without.targets[0].status == "stayed" and "--seed" in without.targets[0].why
    (one,) = apply_programs([path], nominal("ur"), built("ur"), ApplyOptions(seed=q + 0.1)).targets
    assert one.status == "changed" and one.configuration_from == "--seed"
    assert one.joints is not None and np.allclose(one.joints, q, atol=1e-4)
