# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Are the joints as far apart as the robot's file says, or is it the file of another robot?

Torques are linear in masses and frictions once the distances between joints are known. So distances are
fitted by variable projection (Golub and Pereyra, SIAM Journal on Numerical Analysis 10, 1973): of each set of
distances least squares finds the rest, with Kaufman's slopes (BIT 15, 1975), which ask for no least squares
of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import Grid
from truing.dynamics.sanity.readings import Fit, Rows, rows_of

Floats = NDArray[np.float64]

ROWS = 400  # of all recordings
FAIR = 0.05  # of a joint's variance: the question is asked where the file's masses leave more at one,
SCALE, SEEN = 1.25, 0.3  # or where torques that explain this part of it have another scale
SHORTEST = 1e-3  # [m]: a smaller distance is the file's zero
WITHIN = 0.3  # prior: standard deviation of a distance as a part of it; what torques do not tell stays
GAIN_WITHIN = 0.3  # the same, of the scale of a joint's torques
FAR = 0.15  # of a distance: so much two robots of one family differ
SIGMAS = 6.0  # away from the file's; on real arms with the right file: below 3, of single recordings 4.6
SIGMAS_OF_HALF = 2.0  # the same, in each half of the rows
STEP = 1e-4  # [m] of differences
TURNS, SETTLED = 8, 1e-3  # of Gauss-Newton; part of the squares that a turn must take away
RANK = 1e-7  # of the largest eigenvalue of the columns' correlations: a smaller one is nothing


@dataclass(frozen=True)
class _Distance:
    """One number of the file: how far a joint is from the one before it along an axis."""

    joint: int
    name: str  # 'x', 'y', 'z' of the parent's frame, or 'a', 'd' of a link table
    size: float  # [m]


@dataclass(frozen=True)
class _Fitted:
    value: Floats  # [m] of each distance
    change: Floats  # [m] against the file
    sigma: Floats  # [m]


def of_another_robot(robot: _core.Robot, grids: Sequence[Grid], fit: Fit) -> list[RecordingFinding]:
    """Distances between joints that torques contradict. fit: what the file's masses leave."""
    distances = _distances_of(robot)
    if not distances or _fair(fit):
        return []
    rows = rows_of(grids, ROWS)
    found = _fitted(robot, rows, distances)
    far = _far(distances, found, SIGMAS)
    half = len(rows.q) // 2
    for part in (slice(None, half), slice(half, None)) if far.any() else ():
        some = Rows(*(getattr(rows, field.name)[part] for field in fields(rows)))
        own = _fitted(robot, some, distances)
        far &= _far(distances, own, SIGMAS_OF_HALF) & (np.sign(own.change) == np.sign(found.change))
    return [_said(robot, distances, found, far)] if far.any() else []


def _fair(fit: Fit) -> bool:
    """Whether torques are about what the file's masses make them."""
    heavy = fit.scale[fit.by_rigid > SEEN]
    return not (np.any(fit.left > FAIR) or np.any((heavy > SCALE) | (heavy < 1.0 / SCALE)))


def _distances_of(robot: _core.Robot) -> list[_Distance]:
    """All that are not zero, but those before the first joint, which move the whole robot."""
    out = []
    for j, joint in enumerate(robot.joints):
        if robot.convention == "urdf":
            sizes = zip("xyz", np.asarray(joint.T_parent_joint)[:3, 3], strict=True)
        else:
            sizes = zip("ad", (joint.a, joint.d), strict=True)
        out += [_Distance(j, name, float(size)) for name, size in sizes if abs(size) > SHORTEST]
    return [one for one in out if one.joint > 0]


def _with(robot: _core.Robot, distances: Sequence[_Distance], values: Floats) -> _core.Robot:
    robot = robot.copy()
    for one, value in zip(distances, values, strict=True):
        joint = robot.joints[one.joint]
        if robot.convention == "urdf":
            frame = np.array(joint.T_parent_joint)
            frame["xyz".index(one.name), 3] = value
            joint.T_parent_joint = frame
        else:
            setattr(joint, one.name, float(value))
    return robot


def _columns(robot: _core.Robot, rows: Rows, scale: Floats) -> Floats:
    """All that torques are linear in: masses and inertias of links, by each joint's scale of torques; each
    joint's Coulomb and viscous friction, rotor and offset. shape=(n, joints, columns)
    """
    links = np.asarray(_core.torque_regressor(robot, rows.q, rows.qd, rows.qdd)) * scale[:, None]
    n, joints, _ = links.shape
    own = np.zeros((n, joints, joints, 4))
    for j in range(joints):
        own[:, j, j] = np.column_stack([rows.direction[:, j], rows.qd[:, j], rows.qdd[:, j], np.ones(n)])
    return np.concatenate([links, own.reshape(n, joints, 4 * joints)], axis=2)


def _weighed(columns: Floats, rows: Rows, sigma: Floats) -> Floats:
    """Columns of the measured torques, each joint's in units of its own sigma.
    shape=(measured torques, columns)
    """
    return np.asarray((columns / sigma[:, None])[~np.isnan(rows.torque)])


@dataclass(frozen=True)
class _Projection:
    """The torques, each joint's in units of its own sigma, without what columns can make of them."""

    left: Floats  # shape=(measured torques,)
    values: Floats  # of the columns, which leave this
    basis: Floats  # orthonormal, of the space of the columns

    def beyond(self, torque: Floats) -> Floats:
        """What no column makes of such torques."""
        return np.asarray(torque - self.basis @ (self.basis.T @ torque))


def _projected(weighed: Floats, rows: Rows, sigma: Floats) -> _Projection:
    """Least squares by all columns, as `_weighed` gives them: the shortest where several would do."""
    torque = (rows.torque / sigma)[~np.isnan(rows.torque)]
    size = np.linalg.norm(weighed, axis=0)
    there = size > 0.0
    columns = weighed[:, there] / size[there]
    eigenvalues, vectors = np.linalg.eigh(columns.T @ columns)
    seen = eigenvalues > RANK * eigenvalues[-1]
    to_basis = vectors[:, seen] / np.sqrt(eigenvalues[seen])
    basis = columns @ to_basis
    along = basis.T @ torque
    values = np.zeros(len(size))
    values[there] = to_basis @ along / size[there]
    return _Projection(np.asarray(torque - basis @ along), values, basis)


def _noise(robot: _core.Robot, rows: Rows) -> Floats:
    """Root mean square of what is left of each joint with the file's distances. shape=(joints,)"""
    measured = ~np.isnan(rows.torque)
    usual = np.array(
        [
            torque[there].std() if there.any() else 1.0
            for torque, there in zip(rows.torque.T, measured.T, strict=True)
        ]
    )
    usual = np.where(usual > 0.0, usual, 1.0)
    left = np.zeros(rows.torque.shape)
    columns = _columns(robot, rows, np.ones(len(usual)))
    left[measured] = _projected(_weighed(columns, rows, usual), rows, usual).left
    rms = np.sqrt((left**2).sum(axis=0) / np.maximum(1, measured.sum(axis=0)))
    return np.asarray(usual * np.maximum(rms, 1e-3))


def _fitted(robot: _core.Robot, rows: Rows, distances: Sequence[_Distance]) -> _Fitted:
    """Gauss-Newton on the projected residual. What the file says is the prior of distances, and one of the
    scales of torques: a drive's constant that is wrong is none of the file of another robot.
    """
    few, joints = len(distances), rows.torque.shape[1]
    file = np.array([*(one.size for one in distances), *np.ones(joints)])
    prior = np.abs(file) * np.repeat([WITHIN, GAIN_WITHIN], [few, joints])
    sigma = _noise(robot, rows)

    def columns(value: Floats) -> Floats:
        return _weighed(_columns(_with(robot, distances, value[:few]), rows, value[few:]), rows, sigma)

    def at(value: Floats) -> tuple[_Projection, float]:
        projection = _projected(columns(value), rows, sigma)
        left = projection.left
        return projection, float(left @ left + np.sum(((value - file) / prior) ** 2))

    value = file
    here, now = at(value)
    for _ in range(TURNS):
        moved = [columns(value + STEP * axis) @ here.values for axis in np.eye(len(file))]
        jacobian = (
            -here.beyond(np.column_stack(moved)) / STEP
        )  # beyond() of those that did not move is nought
        normal = jacobian.T @ jacobian + np.diag(prior**-2.0)
        step = np.linalg.solve(normal, -jacobian.T @ here.left - (value - file) / prior**2)
        other, then = at(value + step)
        while then > now and np.abs(step).max() > STEP:
            step *= 0.5
            other, then = at(value + step)
        if then > now:
            break
        settled = now - then < SETTLED * now
        value, here, now = value + step, other, then
        if settled:
            break
    sigmas = np.sqrt(np.diag(np.linalg.inv(normal)))
    return _Fitted(value[:few], (value - file)[:few], sigmas[:few])


def _far(distances: Sequence[_Distance], found: _Fitted, sigmas: float) -> NDArray[np.bool_]:
    """Which distances are certainly others than the file's."""
    size = np.abs(found.change)
    far = np.array([FAR * abs(one.size) for one in distances])
    return np.asarray((size > far) & (size > sigmas * found.sigma))


def _said(
    robot: _core.Robot, distances: Sequence[_Distance], found: _Fitted, far: NDArray[np.bool_]
) -> RecordingFinding:
    names = [joint.name for joint in robot.joints]
    which = [int(k) for k in np.flatnonzero(far)]
    each = [
        f"{names[distances[k].joint]} is {found.value[k]:.2g} ± {found.sigma[k]:.1g} m from"
        f" {names[distances[k].joint - 1]} along {distances[k].name} ({distances[k].size:.2g} m in the file)"
        for k in which
    ]
    words = (
        f"by the torques, {listed(each)}: the file of another robot? Names and masses mean nothing until it"
        " is the right one"
    )
    worst = max(which, key=lambda k: abs(float(found.change[k])))
    joints = tuple(names[distances[k].joint] for k in which)
    return RecordingFinding("link_length", (), joints, words, float(found.value[worst]), "m", mistake=True)
