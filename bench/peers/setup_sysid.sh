#!/bin/sh
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
# Make the environment of mujoco.sysid, for ../real_servo.py:  ./setup_sysid.sh DIR
set -eu
dir=${1:?usage: setup_sysid.sh DIR}
[ -x "$dir/sysid/bin/python" ] || "${PYTHON:-python3}" -m venv "$dir/sysid"
"$dir/sysid/bin/python" -m pip install --quiet --disable-pip-version-check "mujoco[sysid]==4.0.0"
