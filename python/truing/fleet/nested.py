# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Least squares of unknowns that all arms share beside unknowns of each arm alone, from a Gram for each arm.

The normal equations have the form of an arrow: a block A for each arm's own unknowns, B for what it has in
common with the shared ones, C of these. Each arm's own are eliminated first, S = C - Bᵀ A⁻¹ B (the Schur
complement of its block), and the rest is as large as one robot's, whatever the number of arms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.fleet.gram import Gram

Floats = NDArray[np.float64]
Integers = NDArray[np.intp]

RANK_TOLERANCE = 1e-6  # as `identify` has it: what others explain of a unit column up to this is not seen


class Equations(Protocol):
    """What of a Gram is used here: normal equations at a point, of rows r + J step."""

    @property
    def xx(self) -> Floats: ...
    @property
    def xr(self) -> Floats: ...
    @property
    def rr(self) -> float: ...
    @property
    def values(self) -> int: ...
    @property
    def scores(self) -> Floats: ...


@dataclass(frozen=True)
class Place:
    """Where an arm's columns go: own[k] and shared[k] are columns of its Gram, into[k] the shared unknown."""

    own: Integers
    shared: Integers
    into: Integers
    frozen: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # own ones that nothing shows


@dataclass(frozen=True)
class Layout:
    """Which unknowns are fitted: names of the shared ones, and each arm's place."""

    shared: tuple[str, ...]
    arms: Mapping[str, Place]
    # Shared ones that nothing shows, each with the combination that changes no measurement; {}: each arm's
    # own unknowns do the same.
    frozen: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def unknowns(self) -> int:
        return len(self.shared) + sum(len(place.own) for place in self.arms.values())


@dataclass(frozen=True)
class Step:
    """Of all unknowns, and what it promises: the fall of the sum of squares."""

    shared: Floats
    own: Mapping[str, Floats]
    fall: float


@dataclass(frozen=True)
class _Block:
    """One arm's normal equations in their parts."""

    A: Floats
    B: Floats
    C: Floats
    own: Floats  # right side
    shared: Floats


def _block(gram: Equations, place: Place) -> _Block:
    o, s = place.own, place.shared
    return _Block(gram.xx[np.ix_(o, o)], gram.xx[np.ix_(o, s)], gram.xx[np.ix_(s, s)], gram.xr[o], gram.xr[s])


def unit_scale(gram: Floats) -> Floats:
    """1 / length of every column, 1 for those of none: shape=(p,)."""
    diagonal = np.diag(gram)
    return np.asarray(1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)))


def solved(matrix: Floats, right: Floats) -> Floats:
    """Solution of a symmetric positive system, its columns scaled to unit length first."""
    if len(matrix) == 0:
        return np.zeros_like(right)
    scale = unit_scale(matrix)
    by = scale if right.ndim == 1 else scale[:, None]
    return np.asarray(by * np.linalg.solve(scale[:, None] * matrix * scale, by * right))


def inverse(matrix: Floats) -> Floats:
    """Inverse of a Gram matrix through its unit-column scaling."""
    found = solved(matrix, np.eye(len(matrix)))
    return np.asarray(0.5 * (found + found.T))


# ---- Which unknowns are seen
# ---------------------------------------------------------------------------------


def layout_of(
    grams: Mapping[str, Gram], own: Mapping[str, Mapping[str, int]], shared: Mapping[str, int]
) -> Layout:
    """Which unknowns the rows show. own: of each arm, shared: of all; by name with their priority: of two
    that cannot be told apart the one of lower priority stays. Own ones come before shared ones.
    """
    places: dict[str, Place] = {}
    for name, gram in grams.items():
        columns = [k for k, parameter in enumerate(gram.names) if parameter in own[name]]
        seen = _core.seen_columns(
            gram.xx[np.ix_(columns, columns)], [own[name][gram.names[k]] for k in columns], RANK_TOLERANCE
        )
        kept = np.array([columns[k] for k in seen.kept], dtype=np.intp)
        others = [k for k, p in enumerate(gram.names) if p in shared and p not in own[name]]
        frozen = _combinations(seen, [gram.names[k] for k in columns])
        places[name] = Place(kept, np.array(others, np.intp), np.zeros(0, np.intp), frozen)
    names = [name for name in shared if any(name in gram.names for gram in grams.values())]
    return _with_shared_ones_seen(grams, places, names, shared)


def _with_shared_ones_seen(
    grams: Mapping[str, Gram], places: Mapping[str, Place], names: Sequence[str], priority: Mapping[str, int]
) -> Layout:
    """Leaves out shared unknowns that the arms' own ones explain, or other shared ones."""
    everything = Layout(tuple(names), {a: _into(grams[a], place, names) for a, place in places.items()})
    S, C = reduced(grams, everything), np.zeros(len(names))
    for a, place in everything.arms.items():
        C[place.into] += np.diag(grams[a].xx)[place.shared]
    visible = np.flatnonzero(np.diag(S.xx) > RANK_TOLERANCE**2 * np.maximum(C, 1e-300))
    seen = _core.seen_columns(
        S.xx[np.ix_(visible, visible)], [priority[names[int(k)]] for k in visible], RANK_TOLERANCE
    )
    kept = [names[int(visible[k])] for k in seen.kept]
    frozen: dict[str, dict[str, float]] = {name: {} for k, name in enumerate(names) if k not in visible}
    frozen |= _combinations(seen, [names[int(k)] for k in visible])
    return Layout(tuple(kept), {a: _into(grams[a], place, kept) for a, place in places.items()}, frozen)


def _into(gram: Gram, place: Place, names: Sequence[str]) -> Place:
    """The place with its shared columns among these names."""
    at = {name: k for k, name in enumerate(names)}
    kept = [k for k in place.shared if gram.names[k] in at]
    into = np.array([at[gram.names[k]] for k in kept], dtype=np.intp)
    return Place(place.own, np.array(kept, dtype=np.intp), into, place.frozen)


def _combinations(seen: _core.SeenColumns, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """What changes no measurement: by the unknown that is held, weights by name."""
    weights = np.asarray(seen.combination)
    return {
        names[frozen]: {names[frozen]: 1.0}
        | {names[k]: -float(w) for k, w in zip(seen.kept, weights[:, j], strict=True) if w != 0.0}
        for j, frozen in enumerate(seen.frozen)
    }


# ---- Steps and covariance
# --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reduced:
    """What is left for the shared unknowns once each arm's own are eliminated."""

    xx: Floats  # S, summed over the arms
    xr: Floats
    rr: float  # of the residuals that the own unknowns cannot lower
    values: float  # measured numbers less own unknowns


def reduced(grams: Mapping[str, Equations], layout: Layout, mu: float = 0.0) -> Reduced:
    """Schur complement of every arm's block, summed in the order of the arms. mu: damping on unit columns."""
    n = len(layout.shared)
    S, g, rr, values = np.zeros((n, n)), np.zeros(n), 0.0, 0.0
    for name, place in layout.arms.items():
        block = _block(grams[name], place)
        A = block.A + mu * np.diag(np.diag(block.A))
        both = solved(A, np.column_stack([block.B, block.own]))
        S[np.ix_(place.into, place.into)] += block.C - block.B.T @ both[:, :-1]
        g[place.into] += block.shared - block.B.T @ both[:, -1]
        rr += grams[name].rr - float(block.own @ both[:, -1])
        values += grams[name].values - len(place.own)
    return Reduced(S, g, rr, values)


def damped_step(grams: Mapping[str, Equations], layout: Layout, mu: float) -> Step:
    """(H + mu D) step = -Jᵀ W r, D the diagonal of H (Marquardt 1963: damping on unit columns), block by
    block.
    """
    whole = reduced(grams, layout, mu)
    diagonal = np.zeros(len(layout.shared))
    for name, place in layout.arms.items():
        diagonal[place.into] += np.diag(grams[name].xx)[place.shared]
    shared = -solved(whole.xx + mu * np.diag(diagonal), whole.xr)
    own: dict[str, Floats] = {}
    fall = -shared @ _shared_gradient(grams, layout) + mu * float(diagonal @ shared**2)
    for name, place in layout.arms.items():
        block = _block(grams[name], place)
        lengths = np.diag(block.A)
        own[name] = -solved(block.A + mu * np.diag(lengths), block.own + block.B @ shared[place.into])
        fall += -own[name] @ block.own + mu * float(lengths @ own[name] ** 2)
    return Step(shared, own, float(fall))


def _shared_gradient(grams: Mapping[str, Equations], layout: Layout) -> Floats:
    out = np.zeros(len(layout.shared))
    for name, place in layout.arms.items():
        out[place.into] += grams[name].xr[place.shared]
    return out


@dataclass(frozen=True)
class Covariance:
    """Of the shared unknowns, and of each arm's own."""

    shared: Floats
    own: Mapping[str, Floats]


def covariance(grams: Mapping[str, Equations], layout: Layout) -> Covariance:
    """Clustered by pose, H⁻¹ M H⁻¹ with M the sum of the poses' scores (Liang and Zeger 1986), in the blocks
    of the arrow: no matrix is larger than one arm's. The Grams must have scores.
    """
    n = len(layout.shared)
    V, M = inverse(reduced(grams, layout).xx), np.zeros((n, n))
    parts: dict[str, Any] = {}
    for name, place in layout.arms.items():
        gram, block = grams[name], _block(grams[name], place)
        o, s = place.own, place.shared
        A1 = inverse(block.A)
        T = -A1 @ block.B  # own unknowns by the shared ones
        # What the own unknowns took up of the noise is missing in the scores (HC1: MacKinnon and White 1985).
        scores = gram.scores * (gram.values / max(1, gram.values - len(o)))
        oo, os, ss = scores[np.ix_(o, o)], scores[np.ix_(o, s)], scores[np.ix_(s, s)]
        M[np.ix_(place.into, place.into)] += T.T @ oo @ T + T.T @ os + os.T @ T + ss
        parts[name] = (A1, T, oo, oo @ T + os)
    shared = V @ M @ V
    own: dict[str, Floats] = {}
    for name, place in layout.arms.items():
        A1, T, oo, cross = parts[name]
        mine = np.ix_(place.into, place.into)
        # Own unknowns follow their rows and, by T, the shared ones: to these the arm's own rows contributed
        # too.
        both = A1 @ cross @ V[mine] @ T.T
        own[name] = A1 @ oo @ A1 + T @ shared[mine] @ T.T + both + both.T
    return Covariance(shared, own)
