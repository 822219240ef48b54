# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Other methods on the rows that a diagnosis of torques sees: same folds, same derivatives, same filter.

`rows_of` has bench_dynamics_rows write them. Every method is a function from rows to torques of all rows,
fitted to those of training at joints that move.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truing.dynamics import Recording
from truing.model import Robot

Floats = NDArray[np.float64]

RIDGES = 10.0 ** np.arange(-8.0, 3.0)  # of columns of unit rms, over the number of rows
MOST_TREES = 200
INNER = 4  # every so many folds one says how many trees are best


class NotInstalledError(Exception):
    """A peer that is not there, and why."""


def percent(predicted: Floats, measured: Floats) -> Floats:
    """Rms error of each joint, in % of the standard deviation of its torque. shape=(rows, joints) [Nm | N]"""
    return np.asarray(100.0 * np.sqrt(np.mean((predicted - measured) ** 2, axis=0)) / measured.std(axis=0))


@dataclass(frozen=True)
class Column:
    """A parameter's torque at one joint."""

    joint: int
    standard: bool  # of standard practice: inertial parameters, Coulomb, viscous, offset
    effect: str
    group: int  # form of the effect
    parameter: str


@dataclass(frozen=True)
class Rows:
    """Rows of all recordings; tables have shape=(rows, joints)."""

    urdf: Path
    train: NDArray[np.int_]  # shape=(rows,): fold, or -1
    test: NDArray[np.int_]
    q: Floats
    qd: Floats
    qdd: Floats
    torque: Floats  # measured [Nm], low-passed
    nominal: Floats
    moving: NDArray[np.bool_]
    columns: list[Column]
    values: list[Floats]  # of every joint, shape=(rows, its columns), low-passed

    def percent(self, predicted: Floats) -> Floats:
        """Of held-out rows."""
        held = self.test >= 0
        return percent(predicted[held], self.torque[held])


def rows_of(
    program: Path,
    urdf: Path,
    robot: Robot,
    recordings: Sequence[Recording],
    cutoff: float = 8.0,
    test_share: float = 0.3,
) -> Rows:
    gains = [robot.joints[index].torque_per_ampere or 1.0 for index in robot.driven_joints()]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "robot.urdf").write_bytes(urdf.read_bytes())
        lines = [f"{cutoff!r} {test_share!r} {len(recordings)}"]
        for number, one in enumerate(recordings):
            torque = one.torque if one.torque.shape[1] else one.current * gains
            table = np.column_stack([one.time, one.position, torque])
            table.astype(np.float64).tofile(folder / f"{number}.in")
            lines.append(f"{one.name.replace(' ', '_')} {int(one.test)} {len(table)}")
        (folder / "task.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
        done = subprocess.run([str(program), place], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{program} failed:\n{done.stderr}")
        words = [line.split() for line in done.stdout.splitlines()]
        columns = [Column(int(w[0]), w[1] == "1", w[2], int(w[3]), w[4]) for w in words]
        n = len(gains)
        table = np.fromfile(folder / "rows.out").reshape(-1, 4 + 6 * n)
        values = [np.fromfile(folder / f"{j}.out").reshape(len(table), -1) for j in range(n)]
    parts = [table[:, 4 + k * n : 4 + (k + 1) * n] for k in range(6)]
    folds = table[:, 1:3].astype(int).T
    return Rows(urdf, folds[0], folds[1], *parts[:5], parts[5] > 0.5, columns, values)


# ---- Least squares over columns --------------------------------------------------------------------


class Sums:
    """Normal equations of all joints, by fold of training; columns are scaled to unit rms."""

    def __init__(self, rows: Rows, wanted: Callable[[Column], bool]) -> None:
        names = list(dict.fromkeys(c.parameter + f"#{c.group}" for c in rows.columns if wanted(c)))
        number = {name: k for k, name in enumerate(names)}
        self.rows = rows
        self.at: list[NDArray[np.int_]] = []  # of every joint: numbers of its columns among all
        self.values: list[Floats] = []
        for j in range(rows.torque.shape[1]):
            own = [(k, c) for k, c in enumerate(c for c in rows.columns if c.joint == j) if wanted(c)]
            self.at.append(np.array([number[c.parameter + f"#{c.group}"] for _, c in own], dtype=int))
            self.values.append(rows.values[j][:, [k for k, _ in own]])
        self.folds = int(rows.train.max()) + 1
        p = len(names)
        self.xx = np.zeros((len(self.at), self.folds, p, p))
        self.xy = np.zeros((len(self.at), self.folds, p))
        self.n = np.zeros((len(self.at), self.folds))
        for j, (at, values) in enumerate(zip(self.at, self.values, strict=True)):
            for fold in range(self.folds):
                used = (rows.train == fold) & rows.moving[:, j]
                x, y = values[used], (rows.torque - rows.nominal)[used, j]
                self.xx[j, fold][np.ix_(at, at)] = x.T @ x
                self.xy[j, fold][at] = x.T @ y
                self.n[j, fold] = used.sum()

    def solved(self, sigma: Floats, folds: Sequence[int], ridges: Sequence[float]) -> list[Floats]:
        """Values for each ridge: departures from the nominal model. sigma: [Nm] of each joint's error."""
        weight = sigma**-2.0
        xx = np.einsum("j,jfab->ab", weight, self.xx[:, folds])
        xy = np.einsum("j,jfa->a", weight, self.xy[:, folds])
        rows = float(self.n[:, folds].sum())
        scale = np.sqrt(np.maximum(np.diag(xx), 1e-300) / rows)
        eigen, vectors = np.linalg.eigh(xx / np.outer(scale, scale) / rows)
        along = vectors.T @ (xy / scale / rows)
        return [vectors @ (along / (np.maximum(eigen, 0.0) + ridge)) / scale for ridge in ridges]

    def predicted(self, values: Floats) -> Floats:
        parts = [x @ values[at] for at, x in zip(self.at, self.values, strict=True)]
        return self.rows.nominal + np.column_stack(parts)


def weighted(rows: Rows, wanted: Callable[[Column], bool]) -> Floats:
    """Weighted least squares by the errors of each joint (Gautier 1997), in three rounds; what the data
    cannot tell, inertial parameters beyond the base parameters, stays nominal.
    """
    sums = Sums(rows, wanted)
    every = list(range(sums.folds))
    sigma = rows.torque[rows.train >= 0].std(axis=0)
    for _ in range(3):
        (values,) = sums.solved(sigma, every, [1e-12])
        predicted = sums.predicted(values)
        sigma = errors_of(rows, predicted)
    return predicted


def errors_of(rows: Rows, predicted: Floats) -> Floats:
    """[Nm] rms of each joint in training."""
    used = (rows.train >= 0)[:, None] & rows.moving
    return np.asarray(np.sqrt(np.sum(np.where(used, predicted - rows.torque, 0.0) ** 2, 0) / used.sum(0)))


def standard(rows: Rows) -> Floats:
    """Base parameters, Coulomb, viscous, offset."""
    return weighted(rows, lambda c: c.standard)


def with_rotors(rows: Rows) -> Floats:
    """The same and rotor inertias: what FIGAROH fits."""
    return weighted(rows, lambda c: c.standard or c.effect == "armature")


def ridge(rows: Rows) -> Floats:
    """All columns of the catalogue at once, every form of every effect; one ridge, by leaving out one fold
    after the other.
    """
    sums = Sums(rows, lambda c: True)
    sigma = errors_of(rows, standard(rows))
    risk = np.zeros(len(RIDGES))
    for left in range(sums.folds):
        kept = [fold for fold in range(sums.folds) if fold != left]
        used = (rows.train == left)[:, None] & rows.moving
        for k, values in enumerate(sums.solved(sigma, kept, list(RIDGES))):
            error = (sums.predicted(values) - rows.torque) / sigma
            risk[k] += float(np.sum(error[used] ** 2))
    best = float(RIDGES[int(np.argmin(risk))])
    (values,) = sums.solved(sigma, list(range(sums.folds)), [best])
    return sums.predicted(values)


# ---- Boosted trees -----------------------------------------------------------------------------------


def trees(rows: Rows) -> Floats:
    """On angles, speeds, accelerations, and the torques of the nominal model."""
    return boosted(rows, np.zeros_like(rows.torque), rows.nominal)


def trees_on_standard(rows: Rows) -> Floats:
    """The same on what standard practice leaves: the structure that is left there."""
    base = standard(rows)
    return boosted(rows, base, base)


def boosted(rows: Rows, base: Floats, torque: Floats) -> Floats:
    """base with boosted trees on what it leaves; how many: by folds left out."""
    try:
        from sklearn.ensemble import HistGradientBoostingRegressor
        from threadpoolctl import threadpool_limits
    except ImportError:
        raise NotInstalledError("scikit-learn is not installed: pip install truing[bench]") from None
    features = np.column_stack([rows.q, rows.qd, rows.qdd, torque])
    left = rows.torque - base
    out = base.copy()
    with threadpool_limits(1):  # two threads that wait for each other are slower beside other work
        for j in range(left.shape[1]):
            used = (rows.train >= 0) & rows.moving[:, j]
            x, y, inner = features[used], left[used, j], rows.train[used] % INNER == 0
            made = HistGradientBoostingRegressor(max_iter=MOST_TREES, early_stopping=False, random_state=0)
            made.fit(x[~inner], y[~inner])
            risk = [float(np.mean((values - y[inner]) ** 2)) for values in made.staged_predict(x[inner])]
            made.set_params(max_iter=1 + int(np.argmin(risk)))
            out[:, j] += made.fit(x, y).predict(features)
    return out


# ---- FIGAROH -----------------------------------------------------------------------------------------


def figaroh(rows: Rows, python: Path | None) -> Floats:
    """FIGAROH itself, in an environment of its own (peers/peer_figaroh_torques.py), on those rows of
    training in which every joint moves.
    """
    if python is None or not python.is_file():
        raise NotInstalledError("not installed: bench/peers/setup_peers.sh makes its environment")
    with tempfile.TemporaryDirectory() as place:
        data, found = Path(place) / "rows.npz", Path(place) / "found.npz"
        np.savez(
            data,
            q=rows.q,
            qd=rows.qd,
            qdd=rows.qdd,
            torque=rows.torque,
            train=(rows.train >= 0) & rows.moving.all(axis=1),  # its Coulomb column is a bare sign
        )
        script = Path(__file__).with_name("peers") / "peer_figaroh_torques.py"
        done = subprocess.run(
            [str(python), str(script), str(rows.urdf.resolve()), str(data), str(found)],
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            raise NotInstalledError(f"failed: {done.stderr.strip().splitlines()[-1:]}")
        return np.asarray(np.load(found)["torque"])
