# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Fleets of robots, and recordings that do not fit into memory: fitted and diagnosed from sums over
partitions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from truing import _core
from truing.effects import Effect, name_list, split_effects
from truing.errors import InputError
from truing.fleet.fit import Settings, fit, plan_of
from truing.fleet.found import FleetIdentification, found_in
from truing.fleet.gram import ROTATION_LENGTH
from truing.fleet.source import partitions_of
from truing.fleet.workers import Workers, workers_of

Names = str | Sequence[str]


def parameters(
    robot: _core.Robot,
    data: _core.Measurements,
    *,
    free: Names = (),
    hold: Names = (),
    effects: Names = (),
) -> dict[str, float]:
    """Names and values of the parameters that `identify` would fit to these rows, in the order of the model:
    what `truing.Gram.of` takes.

    Raises InputError on names or effects that are not known.
    """
    settings = settings_of(free=free, hold=hold, effects=effects)
    found = _core.free_parameters(
        robot, data, free=settings.free, hold=settings.hold, effects=settings.effects
    )
    return {p.name: p.value for p in found}


def identify(
    robot: _core.Robot,
    source: Any,
    client: Any = None,
    *,
    free: Names = (),
    hold: Names = (),
    effects: Names = (),
    own: Names = "*.offset",
    one_arm: bool = False,
    loss: str = "reject",
    test_share: float = 0.2,
    seed: int = 0,
    rotation_length: float = ROTATION_LENGTH,
    max_iterations: int = 50,
    skip_corrupt: bool = False,
    workers: int | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> FleetIdentification:
    """Find what all arms of a type share, and what each has of its own.

        found = truing.fleet.identify(robot, "recordings/")
        found.robot, found.arms["a017"].robot

    Every arm has its own base, targets and zeros; the geometry (or `free`) is one for all.

    robot: nominal, of all arms. source: files, a folder of Parquet or CSV files, or a dask.dataframe, with
    the columns of measurements. A row is of the arm that its column `arm` names, or its folder `arm=NAME/`,
    or its file; one_arm: files are parts of one recording of one arm. client: of Dask; None: a cluster on
    this machine, for this call, of so many `workers` (None: one a processor; 0: this process alone). free,
    hold, effects: names and globs as in `truing.identify`, of what all arms share. own: names and globs of
    what each arm has of its own. loss: "reject" leaves gross outliers out, arm by arm; "none" keeps all rows.
    test_share: fraction of the poses held out where rows have no `set`. seed: of that choice.
    rotation_length: [m] a rotation error of 1 rad counts as this length, where rows give no sigma.
    skip_corrupt: partitions that cannot be read are passed over and named in `skipped`. tell: is told what
    begins.

    The same bits on one worker or many. Raises InputError on data or options that cannot be used; it names
    the partition.
    """
    settings = settings_of(
        free=free,
        hold=hold,
        effects=effects,
        own=own,
        loss=loss,
        test_share=test_share,
        seed=seed,
        rotation_length=rotation_length,
        max_iterations=max_iterations,
        skip_corrupt=skip_corrupt,
    )
    with workers_of(client, workers) as at_work:
        return identify_with(at_work, robot, source, settings, one_arm, tell)


def identify_with(
    workers: Workers,
    robot: _core.Robot,
    source: Any,
    settings: Settings,
    one_arm: bool,
    tell: Callable[[str], None],
) -> FleetIdentification:
    """`identify`, by workers that are there already."""
    tell("looking at every row")
    plan = plan_of(workers, partitions_of(source, one_arm=one_arm), robot, settings)
    fitted = fit(workers, plan, settings, tell)
    return found_in(fitted, settings, workers.passes)


def settings_of(
    *, free: Names, hold: Names, effects: Names, own: Names = "*.offset", **others: Any
) -> Settings:
    """The options checked, names as tuples."""
    asked, mine = split_effects(effects)
    if mine:
        raise InputError(
            "effects: a fleet takes effects of the catalogue only: own ones hold Python functions"
        )
    requests = [item for item in asked if not isinstance(item, Effect)]
    if others.get("loss", "reject") not in ("reject", "none"):
        raise InputError(f"loss: found {others['loss']!r}, expected 'reject' or 'none'")
    if not 0.0 <= others.get("test_share", 0.0) < 1.0:
        raise InputError(
            f"test_share: found {others['test_share']}, expected a fraction of 0 or more, below 1"
        )
    if others.get("max_iterations", 1) < 1:
        raise InputError(f"max_iterations: found {others['max_iterations']}, expected 1 or more")
    return Settings(
        free=tuple(name_list(free)),
        hold=tuple(name_list(hold)),
        effects=tuple(requests),
        own=tuple(name_list(own)),
        **others,
    )
