# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics: from recorded motion and torque to the named cause, and back into the simulator.

robot = truing.load_robot("robot.urdf", any_tool=True)
recordings = truing.dynamics.load_recordings("recordings/*.csv", robot)
checked = truing.dynamics.check_recordings(robot, recordings)
print(truing.dynamics.diagnose(checked.robot, checked.recordings, cutoff=checked.cutoff).summary())
"""

from truing._core import (
    FoundTorqueEffect as FoundTorqueEffect,
    Recording as Recording,
    TorqueAlternative as TorqueAlternative,
    TorqueClass as TorqueClass,
    TorqueDiagnoseOptions as TorqueDiagnoseOptions,
    TorqueDiagnosis as TorqueDiagnosis,
    TorqueEffectPair as TorqueEffectPair,
    TorqueEffectSize as TorqueEffectSize,
    TorqueError as TorqueError,
    TorqueErrors as TorqueErrors,
    TorqueFit as TorqueFit,
    TorqueOptions as TorqueOptions,
    TorqueOrder as TorqueOrder,
    TorqueOutlook as TorqueOutlook,
    TorquePlan as TorquePlan,
    TorquePlanOptions as TorquePlanOptions,
    TorquePrediction as TorquePrediction,
    TorqueRegime as TorqueRegime,
    TorqueRun as TorqueRun,
    TorqueTrace as TorqueTrace,
    UnknownTorque as UnknownTorque,
    validate_recording as validate_recording,
)
from truing.dynamics.api import (
    identify as identify,
    plan as plan,
    predict as predict,
    with_payload as with_payload,
)
from truing.dynamics.comparison import compare as compare
from truing.dynamics.diagnosing import diagnose as diagnose
from truing.dynamics.own_effects import MotionInputs as MotionInputs, TorqueEffect as TorqueEffect
from truing.dynamics.rollout import rollout as rollout
from truing.dynamics.sanity import (
    CheckedRecordings as CheckedRecordings,
    RecordingFinding as RecordingFinding,
    check_recordings as check_recordings,
)
from truing.dynamics.uncertainty import Randomisation as Randomisation, randomisation as randomisation
from truing.files import load_recordings as load_recordings
