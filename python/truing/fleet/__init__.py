# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Fleets and long recordings: fits and diagnoses from sums over partitions, on Dask or in this process.

found = truing.fleet.identify(robot, "recordings/")
"""

from truing.fleet.api import identify as identify, parameters as parameters
from truing.fleet.diagnosis import (
    FleetDiagnosis as FleetDiagnosis,
    FleetEffect as FleetEffect,
    diagnose as diagnose,
)
from truing.fleet.found import (
    ArmFound as ArmFound,
    Errors as Errors,
    FleetIdentification as FleetIdentification,
    FleetParameter as FleetParameter,
)
from truing.fleet.gram import ErrorCounts as ErrorCounts, Gram as Gram
from truing.fleet.source import Partition as Partition, partitions_of as partitions_of
from truing.fleet.torques import (
    ArmTorques as ArmTorques,
    FleetDynamics as FleetDynamics,
    StandsOut as StandsOut,
    TorqueErrorOf as TorqueErrorOf,
    dynamics as dynamics,
)
from truing.fleet.workers import client_at as client_at
