# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values of a calibration for controllers and robot descriptions, and what these cannot hold, in millimetres.

    calibration = truing.controllers.load_result("truing-identify")
    exported = truing.controllers.export(calibration, "ur_description")
    print(exported.written.files["kinematics.yaml"], exported.written.remaining)

The way in, a controller's file as a robot, is `truing.files.load_controller`.
"""

from truing.controllers.api import (
    FORMATS as FORMATS,
    Calibration as Calibration,
    Exported as Exported,
    ExportOptions as ExportOptions,
    Format as Format,
    export as export,
    load_result as load_result,
)
from truing.controllers.distances import Distance as Distance, Dropped as Dropped
from truing.controllers.nearest import Nearest as Nearest, nearest as nearest
