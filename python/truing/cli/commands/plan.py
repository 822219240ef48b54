# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Choose the poses that tell most about the robot, and say which effects they tell apart.

Writes poses.csv, result.json, report.html (the standard errors to expect). With --columns or --separate it
also says, before any data, which effects the poses tell apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import (
    INPUTS,
    Angle,
    BaseLink,
    Choice,
    Count,
    EffectNames,
    Effects,
    Flag,
    Free,
    Length,
    Mass,
    Number,
    Parts,
    RobotFile,
    Seed,
    TipLink,
    Words,
    core,
    refused,
)
from truing.cli.tables import joined, mm, say, say_first, table

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from truing.model import Robot
    from truing.planning import Distinction, PlanResult

PANEL = "Calibrate"
APART = "Effects to tell apart"
INDICES = {
    "d": "d_optimal",
    "a": "a_optimal",
    "e": "e_optimal",
    "inverse-condition": "inverse_condition",
    "noise-amplification": "noise_amplification",
}


class Temperatures(Parts):
    """Two temperatures, the lower one first."""

    metavar = "LOW,HIGH"

    def __init__(self, help: str, **common: Any) -> None:
        one = Number(noun="a temperature in deg C", example="20")
        super().__init__(
            help, (one, one), "two temperatures in deg C, the lower one first, such as 20,35", **common
        )

    def read(self, text: str, option: str) -> tuple[float, ...]:
        low, high = super().read(text, option)
        if not low < high:
            raise refused(option, text, self.expected)
        return low, high


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["Robot", "tuple[PlanResult, Distinction | None]"]):
    doing = "planning"

    robot: RobotFile
    poses: Annotated[int, Count("Number of poses.", least=1)] = core("PlanOptions", "poses")
    min_step: Annotated[float, Angle("Every revolute joint moves by more than this from pose to pose.")] = (
        core("PlanOptions", "min_step")
    )
    index: Annotated[
        Literal["d_optimal", "a_optimal", "e_optimal", "inverse_condition", "noise_amplification"],
        Choice(
            "Observability index to maximize: d determinant, a minus the sum of variances, e smallest"
            " singular value, inverse condition number, noise amplification.",
            words=INDICES,
        ),
    ] = core("PlanOptions", "index")
    orientation: Annotated[bool, Flag("Orientations will be measured as well.")] = False
    noise: Annotated[float, Length("Standard deviation of each measured coordinate.", above=0)] = core(
        "PlanOptions", "position_sigma"
    )
    seed: Seed = core("PlanOptions", "seed")
    free: Free = ""
    effects: Effects = ""
    columns: Annotated[
        list[str],
        Words(
            f"What will be recorded and varied as well, of {','.join(INPUTS)}.",
            known=INPUTS,
            metavar="COLUMNS",
            panel=APART,
        ),
    ] = ()  # type: ignore[assignment]
    separate: Annotated[
        str,
        EffectNames(
            "Effects to be told apart: 'backlash,joint_offset:J2'. Poses are added where that helps.",
            panel=APART,
        ),
    ] = ""
    add: Annotated[int, Count("Add no more poses than this for --separate.", panel=APART)] = core(
        "DistinguishOptions", "add"
    )
    payload: Annotated[float, Mass("A pose is measured with this payload, or with none.", panel=APART)] = (
        core("DistinguishOptions", "payload")
    )
    temperatures: Annotated[
        tuple[float, float],
        Temperatures("Temperatures between which the robot warms up and cools down.", panel=APART),
    ] = core("DistinguishOptions", "temperature_low", "temperature_high")
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Robot:
        from truing.cli.reading import load_robot

        return load_robot(self.robot, self.base_link, self.tip_link)

    def solve(self, loaded: Robot, progress: run.Progress) -> tuple[PlanResult, Distinction | None]:
        import truing

        asked = bool(self.columns or self.separate)
        if asked:  # words that mean nothing are refused at once
            steps = [[0.1 * (k + j) for j in range(loaded.driven_count)] for k in range(3)]
            self._distinguish(loaded, steps, add=0)
        planned = truing.plan(
            loaded,
            poses=self.poses,
            min_step=self.min_step,
            index=self.index,
            orientation=self.orientation,
            position_sigma=self.noise,
            seed=self.seed,
            free=self.free,
            effects=self.effects,
        )
        if not asked:
            return planned, None
        return planned, self._distinguish(
            loaded,
            planned.joints,
            add=self.add,
            orientation=self.orientation,
            position_sigma=self.noise,
            min_step=self.min_step,
            seed=self.seed,
        )

    def _distinguish(self, robot: Robot, joints: ArrayLike, **more: Any) -> Distinction:
        import truing

        low, high = self.temperatures
        return truing.distinguish(
            robot,
            joints,
            columns=self.columns,
            separate=self.separate,
            payload=self.payload,
            temperature_low=low,
            temperature_high=high,
            **more,
        )

    def write(
        self, folder: Path, loaded: Robot, found: tuple[PlanResult, Distinction | None], warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.planning.result import write_plan

        return write_plan(
            folder, loaded, *found, index=self.index, noise=self.noise, seed=self.seed, warnings=warnings
        )

    def table(self, result: Mapping[str, Any], found: tuple[PlanResult, Distinction | None]) -> None:
        observable = [p for p in result["parameters"] if p["sigma"] is not None]
        lines = [
            ("poses", str(result["poses"])),
            ("parameters found", f"{len(observable)} of {len(result['parameters'])}"),
        ]
        for unit, noun in (("m", "a length"), ("rad", "an angle")):
            sigmas = [p["sigma"] for p in observable if p["unit"] == unit]
            if sigmas:
                largest = mm(max(sigmas)) if unit == "m" else f"{max(sigmas) * 1e3:.3g} mrad"
                lines.append((f"largest standard error of {noun}", largest))
        table(f"{result['robot']}: plan", ("", ""), lines)
        if "distinguish" in result:
            seen = result["distinguish"]
            print_smallest(seen)
            print_separated(seen)
            print_alike(seen)
            print_not_testable(seen)


def print_smallest(seen: Mapping[str, Any]) -> None:
    """Of each effect the smallest size that would be seen, with the geometry known and with it unknown."""
    from truing.planning.page import size_words

    every: dict[str, list[Mapping[str, Any]]] = {}
    for effect in seen["effects"]:
        every.setdefault(effect["effect"], []).append(effect)
    lines = []
    for name, at in every.items():
        best = min(at, key=lambda e: e["size_at_tip_m"])
        seen_at = [e["size_with_geometry_at_tip_m"] for e in at if e["size_with_geometry"] is not None]
        count = f" ({len(seen_at)} of {len(at)})" if len(at) > 1 else ""
        worst = f"{mm(max(seen_at))}{count}" if seen_at else "no"
        size = size_words(best["size"], best["unit"])
        lines.append((name.replace("_", " "), best["joint"], size, mm(best["size_at_tip_m"]), worst))
    head = ("", "best at", "size", "at the tip", "with geometry, worst joint")
    table("the smallest effects that would be seen", head, lines, words=True)


def print_separated(seen: Mapping[str, Any]) -> None:
    """Pairs that were to be told apart, before and after poses were added."""
    from truing.planning.page import effect_at, size_words

    pairs = seen["separated"]
    if not pairs:
        return

    def size(p: Mapping[str, Any], key: str) -> str:
        return "never" if p[key] is None else size_words(p[key], p["unit"])

    lines = [
        (
            effect_at(p["effect"], p["joint"]),
            effect_at(p["other"], p["other_joint"]),
            f"{p['r2']:.3f}",
            "-" if p["r2_after"] is None else f"{p['r2_after']:.3f}",
            size(p, "size"),
            "-" if p["r2_after"] is None else size(p, "size_after"),
        )
        for p in pairs[:10]
    ]
    head = ("", "from", "R2", "after", "from this size on", "after")
    table(f"to be told apart: {seen['added_poses']} poses added", head, lines, words=True)
    if len(pairs) > len(lines):
        say(f"and {len(pairs) - len(lines)} pairs that are less correlated: see the report")


def print_alike(seen: Mapping[str, Any]) -> None:
    """Pairs that are not told apart; the same pair at several joints is named once."""
    from truing.planning.page import effect_at

    alike: dict[tuple[str, str, str], list[str]] = {}
    for p in seen["alike"]:
        same = p["joint"] == p["other_joint"]
        first, other = (
            (effect_at(p["effect"], ""), effect_at(p["other"], ""))
            if same
            else (effect_at(p["effect"], p["joint"]), effect_at(p["other"], p["other_joint"]))
        )
        alike.setdefault((first, other, p["separated_by"]), []).extend(
            [p["joint"]] if same and p["joint"] else []
        )
    lines = []
    for (first, other, how), joints in alike.items():
        place = f" at {', '.join(joints)}" if joints else ""
        lines.append(f"not told apart: {first} from {other}{place}; what separates them: {how}")
    say_first(lines, 8, "more: see the report")


def print_not_testable(seen: Mapping[str, Any]) -> None:
    from truing.planning.page import effect_at

    words = [f"{effect_at(n['effect'], ', '.join(n['joints']))} ({n['why']})" for n in seen["not_testable"]]
    if words:
        say(f"not testable with such data: {joined(words, 8)}")
