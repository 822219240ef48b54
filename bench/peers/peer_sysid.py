# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""mujoco.sysid asked for gain, damping, dry friction and rotor of each joint of a servo arm.

    python peer_sysid.py TASK.json > ANSWER.json

TASK: mjcf (text with a position actuator and a jointpos sensor for every joint), joints, pieces: [{t, q, u,
qd0, scale}] (rows [s], [rad]; qd0 [rad/s] at the first row; scale: firmware gain over its reference), start
and bounds by parameter. ANSWER: values by parameter and joint, seconds by the clock and of the processor,
threads, version. Run by ../real_servo.py in the environment of setup_sysid.sh.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import time
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

FIELDS = ("gain", "damping", "frictionloss", "armature")


def setter(field: str, joint: str) -> Any:
    """What puts a parameter's value into a model; a model's name is its firmware gain."""

    def put(spec: Any, parameter: Any) -> None:
        value = float(parameter.value[0])
        if field != "gain":
            here = getattr(spec.joint(joint), field)
            if np.ndim(here):  # damping may be a polynomial
                here = np.array(here)
                here[0] = value
                value = here
            setattr(spec.joint(joint), field, value)
            return
        actuator = next(a for a in spec.actuators if a.target == joint)
        gain = value * float(spec.modelname)
        actuator.gainprm[0], actuator.biasprm[1] = gain, -gain

    return put


def sequences(task: dict[str, Any]) -> list[Any]:
    """Pieces by firmware gain, each with the state that it begins in."""
    found = []
    for scale in sorted({piece["scale"] for piece in task["pieces"]}):
        spec = mujoco.MjSpec.from_string(task["mjcf"])
        spec.modelname = repr(scale)
        model = spec.compile()
        own = [piece for piece in task["pieces"] if piece["scale"] == scale]
        states, controls, sensors = [], [], []
        for piece in own:
            t, q, u = (np.array(piece[name]) for name in ("t", "q", "u"))
            states.append(sysid.create_initial_state(model, q[0], np.array(piece["qd0"]), np.zeros(model.na)))
            controls.append(sysid.TimeSeries(t, u))
            sensors.append(sysid.TimeSeries.from_names(t, q, model))
        names = [f"piece{k}" for k in range(len(own))]
        found.append(sysid.ModelSequences(repr(scale), spec, names, states, controls, sensors))
    return found


def main() -> int:
    logging.disable(logging.INFO)
    with open(sys.argv[1], encoding="utf-8") as file:
        task = json.load(file)
    began, used = time.perf_counter(), time.process_time()
    parameters = sysid.ParameterDict()
    for joint in task["joints"]:
        for field in FIELDS:
            low, high = task["bounds"][field]
            one = sysid.Parameter(
                f"{field}.{joint}",
                nominal=task["start"][field],
                min_value=low,
                max_value=high,
                modifier=setter(field, joint),
            )
            parameters.add(one)
    residual = sysid.build_residual_fn(models_sequences=sequences(task))
    stdout, sys.stdout = sys.stdout, sys.stderr  # its progress
    found, _ = sysid.optimize(initial_params=parameters, residual_fn=residual, optimizer="mujoco")
    sys.stdout = stdout
    values = {field: [float(found[f"{field}.{j}"].value[0]) for j in task["joints"]] for field in FIELDS}
    seconds = {"seconds": time.perf_counter() - began, "processor_seconds": time.process_time() - used}
    answer = {**values, **seconds, "threads": os.cpu_count(), "version": mujoco.__version__}
    print(json.dumps(answer))
    return 0


if __name__ == "__main__":
    sys.exit(main())
