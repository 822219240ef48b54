# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servo arms: the cause named from commands and motion alone, by simulations of the actuator chain.

    found = truing.dynamics.diagnose("so101.xml", recordings)  # no torques: a ServoDiagnosis
    print(found.summary())

`ServoChain` is the actuator chain as data (its law: `truing.dynamics.servo.chain`); a `ServoDiagnosis` has
three of them, of the file ("nominal"), with the usual parameters fitted ("standard") and with what was
named ("named"), the covariance of what was fitted, and what `servo_dict` writes to result.json.
"""

from truing.dynamics.servo.api import (
    by_commands as by_commands,
    servo_diagnose as servo_diagnose,
)
from truing.dynamics.servo.chain import (
    PARAMETERS as PARAMETERS,
    DriveParameter as DriveParameter,
    ServoChain as ServoChain,
    ServoJoint as ServoJoint,
)
from truing.dynamics.servo.result import (
    WHOLE as WHOLE,
    FoundServoEffect as FoundServoEffect,
    ServoAlternative as ServoAlternative,
    ServoClass as ServoClass,
    ServoCovariance as ServoCovariance,
    ServoDiagnosis as ServoDiagnosis,
    ServoParameter as ServoParameter,
    ServoRollout as ServoRollout,
    ServoTrace as ServoTrace,
    UnknownMotion as UnknownMotion,
    servo_dict as servo_dict,
)
