# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which effects all arms of a type have, and which one arm alone: two searches by evidence, on Grams only.

Each arm's own unknowns are eliminated first. What is left of all arms, added up, is searched for what they
share; then what that leaves of each arm, for what it has alone. An effect that one arm alone has is taken out
of what the others say, and the first search begins again, until neither changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.fleet.fit import takes_constants_from_rows
from truing.fleet.gram import Gram
from truing.fleet.nested import Layout, solved

Floats = NDArray[np.float64]

_LARGEST = (
    1e-2  # [m] motion of the tip (rms) that an effect may well make; a thousandth of it is tried as well
)
_ROUNDS = 6
_NATS = 4.0  # that a group must win beyond the cost of having looked at all, as `diagnose` has it
_VARIES = 0.25  # of the arms, from which on an effect that each has by itself is no fault but a scatter


@dataclass(frozen=True)
class Candidate:
    """An effect at a joint (or of the robot as a whole): the parameters that stand for it."""

    effect: str
    joints: tuple[str, ...]
    parameters: tuple[str, ...]
    requests: tuple[_core.EffectRequest, ...] = ()  # none: the parameters are the model's own
    of_links: bool = False

    @property
    def called(self) -> str:
        """backlash J2"""
        return " ".join((self.effect.replace("_", " "), *self.joints))


@dataclass(frozen=True)
class NotTestable:
    """An effect that these rows could not show, and why."""

    effect: str
    why: str


@dataclass(frozen=True)
class Named:
    """A candidate that was chosen."""

    candidate: Candidate
    nats: float  # that it wins beyond its cost
    size_at_tip: float  # [m] rms motion of the tip by it, beyond what base, tool and zeros can do
    rivals: tuple[Candidate, ...]  # that would do as well


@dataclass(frozen=True)
class Choice:
    """What was named: of all arms, of arms one by one, and what each arm has to a size of its own."""

    of_all: tuple[Named, ...]
    of_arms: Mapping[str, tuple[Named, ...]]
    scattered: tuple[Candidate, ...]  # found in so many arms that it is no fault


# ---- Candidates
# ------------------------------------------------------------------------------------------------


def candidates_of(
    robot: _core.Robot, samples: Sequence[_core.Measurements], leave_out: Sequence[str] = ()
) -> tuple[list[Candidate], list[NotTestable]]:
    """Effects that every arm's rows can show, each at every joint that it suits."""
    found: list[Candidate] = []
    not_testable: list[NotTestable] = []
    plain = {p.name for p in _core.free_parameters(robot, samples[0])}
    for effect in _core.catalogue_effects():
        name, traits = effect.name, effect.traits
        if traits.search != "always" or name in leave_out:
            continue
        if traits.stands_for == "geometry":
            found += _links(robot, samples[0], name)
        if traits.stands_for not in ("", "ratio") or (traits.needs_masses and not _knows_masses(robot)):
            continue
        joints = [robot.joints[k].name for k in robot.driven_joints()]
        here = [
            _of_effect(robot, samples, name, at, plain)
            for at in ([[j] for j in joints] if effect.per_joint else [[]])
        ]
        found += [one for one in here if isinstance(one, Candidate)]
        why = [one for one in here if isinstance(one, str)]
        if why and len(why) == len(here):
            not_testable.append(NotTestable(name, why[0]))
    return found, not_testable


def _knows_masses(robot: _core.Robot) -> bool:
    return any(joint.mass is not None for joint in robot.joints)


def _links(robot: _core.Robot, data: _core.Measurements, effect: str) -> list[Candidate]:
    geometry = [p.name for p in _core.free_parameters(robot, data) if p.role == "geometry"]
    of = {
        joint.name: tuple(n for n in geometry if n.rpartition(".")[0] == joint.name) for joint in robot.joints
    }
    return [Candidate(effect, (joint,), names, of_links=True) for joint, names in of.items()]


def _of_effect(
    robot: _core.Robot, samples: Sequence[_core.Measurements], effect: str, joints: list[str], plain: set[str]
) -> Candidate | str:
    """The candidate, or why there is none."""
    request = _core.EffectRequest(effect, joints)
    try:
        names = [
            [p.name for p in _core.free_parameters(robot, data, effects=[request]) if p.name not in plain]
            for data in samples
        ]
    except InputError as error:
        return str(error)
    if not names[0] or any(other != names[0] for other in names):
        return "not every arm can show it"
    model = {p.name for p in _core.free_parameters(robot, samples[0], free=["*"])}
    if set(names[0]) <= model:
        return Candidate(effect, tuple(joints), tuple(names[0]))
    if takes_constants_from_rows(robot, samples[0], request):
        return "its law takes constants from the rows, and each partition would take others"
    return Candidate(effect, tuple(joints), tuple(names[0]), (request,))


# ---- Sums without each arm's own unknowns
# ----------------------------------------------------------------------


@dataclass(frozen=True)
class Sums:
    """Normal equations of y = X theta + noise, y what the nominal type leaves, X beyond each arm's own
    unknowns.
    """

    xx: Floats
    xy: Floats
    yy: float
    values: float


def _without_own(gram: Gram, own: Sequence[int], columns: Sequence[int], shift: Floats) -> Sums:
    """shift: shape=(p,), by how much the point is off the nominal type: y = -r + X shift."""
    xy, yy = -gram.xr + gram.xx @ shift, gram.rr - 2.0 * shift @ gram.xr + shift @ gram.xx @ shift
    A, B = gram.xx[np.ix_(own, own)], gram.xx[np.ix_(own, columns)]
    both = solved(A, np.column_stack([B, xy[list(own)]]))
    return Sums(
        gram.xx[np.ix_(columns, columns)] - B.T @ both[:, :-1],
        xy[list(columns)] - B.T @ both[:, -1],
        float(yy - xy[list(own)] @ both[:, -1]),
        float(gram.values - len(own)),
    )


def _added(parts: Sequence[Sums]) -> Sums:
    return Sums(
        np.sum([p.xx for p in parts], axis=0),
        np.sum([p.xy for p in parts], axis=0),
        float(sum(p.yy for p in parts)),
        sum(p.values for p in parts),
    )


def _less(sums: Sums, theta: Floats) -> Sums:
    """What is left once theta is taken away."""
    yy = sums.yy - 2.0 * theta @ sums.xy + theta @ sums.xx @ theta
    return Sums(sums.xx, sums.xy - sums.xx @ theta, float(yy), sums.values)


# ---- The two searches
# --------------------------------------------------------------------------------------------


class Search:
    """grams: of every arm, with a column for every parameter of the candidates, all at the arm's point.
    shifts: of the shared parameters there from the nominal type, by name. layout: which own unknowns each
    arm's rows show.
    """

    def __init__(
        self,
        grams: Mapping[str, Gram],
        layout: Layout,
        candidates: Sequence[Candidate],
        shifts: Mapping[str, float],
    ) -> None:
        self.grams, self.layout, self.candidates = grams, layout, list(candidates)
        self.names = list(dict.fromkeys(p for c in candidates for p in c.parameters))
        self.shifts = {name: shifts[name] for name in self.names if name in shifts}
        at = {name: k for k, name in enumerate(self.names)}
        self.groups = [[at[p] for p in c.parameters] for c in candidates]
        self.prior = self._prior()
        self.cost = math.log(max(1, len(self.candidates)))

    def _prior(self) -> Floats:
        """The size of each parameter that moves the tip by `_LARGEST` (rms)."""
        square = sum(np.diag(g.xx)[self._columns(g)] for g in self.grams.values())
        values = sum(g.values for g in self.grams.values())
        return np.asarray(
            _LARGEST * math.sqrt(self._weight()) / np.sqrt(np.maximum(3.0 * square / values, 1e-30))
        )

    def _weight(self) -> float:
        """Mean weight of a squared residual [1/m^2]: 1 where rows have no sigma."""
        squares = sum(g.errors.squares for g in self.grams.values() if not g.left_out)
        weighted = sum(g.rr for g in self.grams.values() if not g.left_out)
        turned = any(g.turns.n for g in self.grams.values())
        return weighted / squares if squares > 0.0 and not turned else 1.0

    def _columns(self, gram: Gram) -> list[int]:
        return [gram.names.index(name) for name in self.names]

    def run(self) -> Choice:
        """Both searches in turn, until neither changes."""
        arms: dict[str, tuple[int, ...]] = {}
        alone = {name: self._alone(name, ()) for name in self.grams}
        for _ in range(_ROUNDS):
            pooled = _added([self._alone(name, arms.get(name, ())) for name in self.grams])
            shared = self._choose(pooled, self.cost)
            cost = self.cost + math.log(len(self.grams))
            found = {n: self._choose(_less(one, shared.solution), cost) for n, one in alone.items()}
            now = {name: tuple(sorted(choice.groups)) for name, choice in found.items() if choice.groups}
            if now == arms:
                break
            arms = now
        return self._told(pooled, shared, alone, found)

    def _alone(self, name: str, faults: Sequence[int]) -> Sums:
        """One arm's sums without its own unknowns; of these are what its faults stand for, whose columns are
        0 then.
        """
        gram = self.grams[name]
        columns = self._columns(gram)
        mine = sorted({k for g in faults for k in self.groups[g]})
        own = [*self.layout.arms[name].own, *self._independent(gram, name, [columns[k] for k in mine])]
        shift = np.array([self.shifts.get(parameter, 0.0) for parameter in gram.names])
        sums = _without_own(gram, own, columns, shift)
        sums.xx[mine, :] = 0.0
        sums.xx[:, mine] = 0.0
        sums.xy[mine] = 0.0
        return sums

    def _independent(self, gram: Gram, name: str, columns: Sequence[int]) -> list[int]:
        """Those of an arm's columns that its own unknowns and one another do not explain."""
        own = list(self.layout.arms[name].own)
        both = [*own, *columns]
        seen = _core.seen_columns(gram.xx[np.ix_(both, both)], [0] * len(own) + [1] * len(columns))
        return [both[k] for k in seen.kept if k >= len(own)]

    def _choose(self, sums: Sums, cost: float) -> _core.GroupChoice:
        return _core.choose_groups(
            sums.xx, sums.xy, sums.yy, sums.values, self.groups, self.prior, cost, _NATS
        )

    def _told(
        self,
        pooled: Sums,
        shared: _core.GroupChoice,
        alone: Mapping[str, Sums],
        found: Mapping[str, _core.GroupChoice],
    ) -> Choice:
        having: dict[int, int] = {}
        for choice in found.values():
            for group in choice.groups:
                having[group] = having.get(group, 0) + 1
        often = {g for g, count in having.items() if count > max(2.0, _VARIES * len(self.grams))}
        of_arms = {
            name: tuple(
                n for n in self._named(alone[name], choice) if self.candidates.index(n.candidate) not in often
            )
            for name, choice in found.items()
        }
        return Choice(
            tuple(self._named(pooled, shared)),
            {name: named for name, named in of_arms.items() if named},
            tuple(self.candidates[g] for g in sorted(often)),
        )

    def _named(self, sums: Sums, choice: _core.GroupChoice) -> list[Named]:
        out = []
        for group, nats, rivals in zip(choice.groups, choice.nats, choice.rivals, strict=True):
            columns = self.groups[group]
            theta = np.asarray(choice.solution)[columns]
            square = float(theta @ sums.xx[np.ix_(columns, columns)] @ theta)
            tip = math.sqrt(max(0.0, 3.0 * square / sums.values / self._weight()))
            out.append(Named(self.candidates[group], nats, tip, tuple(self.candidates[g] for g in rivals)))
        return sorted(out, key=lambda named: -named.nats)
