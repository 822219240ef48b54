# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Plan a motion that tells effects on torques apart, and say which it could show, and from which size on.

Writes motion.csv (t_s, positions and speeds of the joints), result.json, report.html. With recordings it also
says what these can show, and which columns they lack.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import (
    Angle,
    Count,
    File,
    Fraction,
    Frequency,
    Kind,
    Length,
    Mass,
    Names,
    Number,
    Numbers,
    Seed,
    Threads,
    Time,
    Words,
    core,
)
from truing.cli.recordings import ReadMotion, RobotWithMasses
from truing.cli.tables import joined, say_first, table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.dynamics import Recording, TorquePlan
    from truing.model import Robot

PANEL = "Dynamics"
LIMITS, APART, SEARCH = "Limits of the motion", "What is recorded, and told apart", "Search"
COLUMNS = ("current", "torque", "payload", "temp")
LISTED = 10  # lines of a list on the terminal; the report has all


class Posture(Kind):
    """Angles and lengths, one of each joint: "0,-90deg,0,-1.57rad,0.2m"; the field holds a list."""

    metavar = "POSTURE"

    def read(self, text: str, option: str) -> list[float]:
        values = []
        for word in text.split(","):
            unit = word.strip().lstrip("+-0123456789.eE")
            kind = Length() if unit in Length.units else Angle()
            values.append(kind.read(word, option))
        return values


@dataclass(frozen=True, kw_only=True)
class Command(ReadMotion, run.Command["tuple[Robot, list[Recording]]", "TorquePlan"]):
    doing = "planning"

    robot: RobotWithMasses
    recordings: Annotated[
        list[Path],
        File(
            "Recordings that there are, to say what these can show; torques are not needed.",
            argument=True,
            metavar="[REC]",
            several=True,
        ),
    ] = ()  # type: ignore[assignment]
    duration: Annotated[float, Time("Of the motion.", least=10.0)] = core("TorquePlanOptions", "duration")
    rate: Annotated[float, Frequency("Rows of motion.csv.", least=20.0)] = core("TorquePlanOptions", "rate")
    columns: Annotated[
        list[str],
        Words(
            f"What will be recorded beside joints and torques, of {','.join(COLUMNS)}: torques by current or"
            " by sensors of torque, a known payload in half of the recordings, temperatures.",
            known=COLUMNS,
            metavar="COLUMNS",
            panel=APART,
        ),
    ] = ()  # type: ignore[assignment]
    separate: Annotated[
        str,
        Names("Effects to be told apart: 'stribeck,presliding:J2'. Default: all count alike.", panel=APART),
    ] = ""
    payload: Annotated[float, Mass("At the tool, in half of the recordings.", above=0, panel=APART)] = core(
        "TorquePlanOptions", "payload"
    )
    noise: Annotated[
        float,
        Fraction(
            "Noise of the torques, as part of a torque's standard deviation along a random motion.",
            above=0,
            panel=APART,
        ),
    ] = core("TorquePlanOptions", "noise")
    torque_noise: Annotated[
        list[float] | None,
        Numbers("Noise of every joint's torque [Nm | N], in place of --noise: '0.8,1.1,0.6'.", panel=APART),
    ] = None
    speed: Annotated[float, Fraction("Part of the joints' speed limits used.", above=0, panel=LIMITS)] = core(
        "TorquePlanOptions", "speed"
    )
    usual_speed: Annotated[
        float,
        Number(
            "Speed limit of joints that state none [rad/s | m/s].",
            noun="a speed in rad/s or m/s",
            example="1.5",
            least=1e-3,
            panel=LIMITS,
        ),
    ] = core("TorquePlanOptions", "usual_speed")
    acceleration: Annotated[
        float,
        Number(
            "Largest acceleration of a joint [rad/s^2 | m/s^2].",
            noun="an acceleration in rad/s^2 or m/s^2",
            example="5",
            least=1e-3,
            panel=LIMITS,
        ),
    ] = core("TorquePlanOptions", "acceleration")
    reach: Annotated[
        float, Number("Farthest to either side of --home [rad | m].", least=1e-3, example="1.5", panel=LIMITS)
    ] = core("TorquePlanOptions", "reach")
    home: Annotated[
        list[float] | None,
        Posture(
            "Around which the joints move: '0,-90deg,0,-90deg,0,0'. Default: the middle of their limits.",
            panel=LIMITS,
        ),
    ] = None
    starts: Annotated[int, Count("Random motions, the best of which is refined.", least=1, panel=SEARCH)] = (
        core("TorquePlanOptions", "starts")
    )
    rounds: Annotated[int, Count("Rounds of refinement.", panel=SEARCH)] = core("TorquePlanOptions", "rounds")
    seed: Seed = core("TorquePlanOptions", "seed")
    threads: Threads = core("TorquePlanOptions", "threads")

    def load(self, progress: run.Progress) -> tuple[Robot, list[Recording]]:
        robot = self.read_robot(self.robot)
        if self.recordings:
            return robot, self.read_recordings(robot, self.recordings)
        for option, value in (("--joints", self.joints), ("--topic", self.topic), ("--units", self.units)):
            if value:
                raise InputError(f"{option}: found {value!r}, which is of recordings, and there are none")
        return robot, []

    def solve(self, loaded: tuple[Robot, list[Recording]], progress: run.Progress) -> TorquePlan:
        from truing.dynamics import plan

        return plan(
            *loaded,
            duration=self.duration,
            rate=self.rate,
            columns=self.columns,
            separate=self.separate,
            payload=self.payload,
            noise=self.noise,
            torque_noise=self.torque_noise or [],
            speed=self.speed,
            usual_speed=self.usual_speed,
            acceleration=self.acceleration,
            reach=self.reach,
            home=self.home or [],
            starts=self.starts,
            rounds=self.rounds,
            seed=self.seed,
            threads=self.threads,
        )

    def write(
        self,
        folder: Path,
        loaded: tuple[Robot, list[Recording]],
        found: TorquePlan,
        warnings: list[str],
    ) -> Mapping[str, Any]:
        from truing.dynamics.planned import write_torque_plan

        return write_torque_plan(
            folder, loaded[0], found, seed=self.seed, columns=self.columns, warnings=warnings
        )

    def table(self, result: Mapping[str, Any], found: TorquePlan) -> None:
        from truing.dynamics.plan_page import ratio_of, runs_in_words

        seen = result["planned"]["effects"]
        apart = sum(e["size_apart"] is not None for e in seen)
        lines = [
            ("motion", f"{result['duration_s']:g} s, {result['rows']} rows"),
            ("to record", joined(runs_in_words(result), 4)),
            ("effects seen", f"{len(seen)}, of which {apart} told from all others"),
        ]
        ratio = ratio_of(result)
        if ratio is not None:
            lines.append(("sizes, of those along a random motion", f"{100 * ratio:.0f} %"))
        table(f"{result['robot']}: motion plan", ("", ""), lines)
        print_sizes(seen)
        print_outlook(result["planned"], "such recordings")
        if "given" in result:
            print_outlook(result["given"], "the recordings that there are")


def print_sizes(effects: list[Mapping[str, Any]]) -> None:
    """Of each effect the joint where the smallest shows, and the one where it has to be the largest."""
    from truing.dynamics.plan_page import label, size_text

    every: dict[str, list[Mapping[str, Any]]] = {}
    for effect in effects:
        every.setdefault(effect["effect"], []).append(effect)
    lines = []
    for name, at in every.items():
        best = min(at, key=lambda e: e["torque_Nm"])
        lines.append(
            (
                name.replace("_", " "),
                ", ".join(best["joints"]) or "-",
                size_text(best["size"], best["unit"]),
                f"{best['torque_Nm']:.2g}",
                size_text(best["size_apart"], best["unit"]),
                label(best["closest"], best["closest_joints"]),
            )
        )
    if lines:
        head = ("", "best at", "seen from", "rms torque [Nm | N]", "told apart from", "from")
        table("the smallest effects that would be seen", head, lines, words=True)


def print_outlook(outlook: Mapping[str, Any], what: str) -> None:
    """What is not told apart, and what would not show."""
    from truing.dynamics.plan_page import label, reasons

    pairs: dict[tuple[str, str], str] = {}
    for p in outlook["alike"]:
        pairs.setdefault((p["effect"], p["other"]), p["separated_by"])
    say_first(
        [
            f"{what} do not tell {label(a, ())} from {label(b, ())}; to tell: {how}"
            for (a, b), how in pairs.items()
        ],
        LISTED,
        "more: see the report",
    )
    missing = reasons(outlook["not_testable"]).items()
    words = [f"{label(effect, joints)} ({reason})" for (effect, reason), joints in missing]
    say_first([f"{what} cannot show {w}" for w in words], LISTED, "more: see the report")
