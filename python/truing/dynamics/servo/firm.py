# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values by a loss that few rows do not decide, where folds that were not fitted are predicted better so.

The search weighs squares: what stands out of a model's errors is where a cause may be. Once it has ended, a
stall, a bump, or swings that no law of the catalogue follows would still pull all values their way. Huber's
loss (1964) lets such rows count in proportion; whether it serves better depends on the machine, and is asked
of the folds, as names are.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.fit import Fitted, combined, cut_of, huber_roots, scaled, sums_by_fold
from truing.dynamics.servo.naming import LEAST_GAIN, SURE_GAIN, Account, Namer, squares_of_folds

Floats = NDArray[np.float64]

_TURNS = 10  # of weights and values, linear at a fit


def firm(namer: Namer, account: Account) -> Account:
    """The account with the usual parameters, and all that is named, by the loss that serves each better."""
    standard = firmly(namer, account.standard)
    if account.fitted is account.standard:
        return replace(account, standard=standard, fitted=standard)
    fitted = firmly(namer, account.fitted)
    out = replace(account, standard=standard, fitted=fitted)
    if fitted is account.fitted:
        return out
    noise = namer.noise_after(fitted)
    noise = replace(noise, cut=cut_of(fitted.errors))
    points = [namer.without(out, at, noise).point for at in range(len(out.found))]
    return replace(out, weights=[replace(w, point=p) for w, p in zip(out.weights, points, strict=True)])


def firmly(namer: Namer, fitted: Fitted) -> Fitted:
    """A fit by Huber's loss; itself, where squares predict as well what was not fitted."""
    if not serves(namer, fitted):
        return fitted
    return namer.fitter.firm(fitted, "values that few rows do not decide")


def serves(namer: Namer, fitted: Fitted) -> bool:
    """Whether folds are predicted better, for certain, by Huber's loss over the others than by squares.
    Linear at the fit; recordings of one firmware gain are one fold, where there are several."""
    noise = namer.noise_after(fitted)
    labels = namer.groups
    plain = namer.sums(fitted, [], None, noise, labels)
    fold = np.unique(namer.fitter.rows.fold if labels is None else labels, return_inverse=True)[1]
    pull = np.array([f.prior for f in fitted.free]) ** -2.0
    away = np.array([f.at(fitted.point) - s for f, s in zip(fitted.free, fitted.start, strict=True)])
    left, firmer = fitted.errors, plain.folds
    for _ in range(_TURNS):  # weights and values in turns (Holland and Welsch 1977)
        root = huber_roots(left, cut_of(left))
        table, errors = scaled(fitted.columns, fitted.errors, root)
        firmer = sums_by_fold(table, errors, noise.weight, fold, namer._every())
        xx, xy = sum(part[0] for part in firmer), sum(part[1] for part in firmer)
        values = np.linalg.solve(xx + np.diag(pull), xy - pull * away)
        left = fitted.errors - combined(fitted.columns, values, fitted.errors)
    before, after = squares_of_folds(plain, fitted), squares_of_folds(plain, fitted, by=firmer)
    # Each fold counts alike, by a logarithm: one with a stall is as badly predicted by either.
    falls = np.log(before / np.maximum(after, 1e-300))
    error = falls.std(ddof=1) / math.sqrt(falls.size) if falls.size > 1 else math.inf
    return bool(falls.mean() > max(LEAST_GAIN, SURE_GAIN * error))
