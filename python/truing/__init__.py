# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robot calibration: find how a real robot differs from its model, name the cause, and remove it.

    robot = truing.load_robot("robot.yaml")
    data = truing.load_measurements("measurements.csv", robot)
    found = truing.identify(robot, data, effects="backlash")
    truing.save_robot("calibrated.yaml", found.robot)

    print(truing.diagnose(robot, data).summary())  # which effects cause the gap

The package itself holds what every user needs: verbs, readers and writers, `Robot`, `Measurements`, `Effect`,
errors. What only one verb takes or returns is in the verb's room: `truing.identification.IdentifyOptions`,
`truing.diagnosis.Diagnosis`. Rooms: model, common, files, examples, identification, planning, diagnosis,
dynamics, hand_eye, inverse_kinematics, programs, controllers, performance, tracking, testing.

SI units throughout: m, rad, kg, s. `T_a_b` maps b-coordinates into a. Quaternions are w x y z.
"""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from truing.public import *  # noqa: F403

    __version__: str
else:

    def __getattr__(name):
        """Loads the public names when one is first asked for, so `import truing` costs next to nothing."""
        if not name.startswith("_") or name in ("__all__", "__version__"):
            public = vars(importlib.import_module("truing.public"))
            found = {key: value for key, value in public.items() if not key.startswith("_")}
            verbs = sorted(key for key, value in found.items() if not isinstance(value, ModuleType))
            version = importlib.import_module("truing._core").version()
            globals().update(found, __all__=verbs, __version__=version)
            if name in globals():
                return globals()[name]
        raise AttributeError(f"module 'truing' has no attribute {name!r}")

    def __dir__():
        return [*__getattr__("__all__"), *globals()]
