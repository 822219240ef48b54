#!/bin/sh
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
# Make the environments of the peers:  ./setup_peers.sh DIR
# pybotics and robotkinecal want NumPy 1, FIGAROH and Pinocchio NumPy 2. A peer that
# cannot be installed does not stop the others: peers.py reports it as missing.
set -u
dir=${1:?usage: setup_peers.sh DIR}
python=${PYTHON:-python3}

install() { # environment, packages
    env=$1
    shift
    "$dir/$env/bin/python" -m pip install --quiet --disable-pip-version-check "$@" ||
        echo "could not install: $*" >&2
}

mkdir -p "$dir"
for env in numpy1 numpy2; do
    [ -x "$dir/$env/bin/python" ] || "$python" -m venv "$dir/$env" || exit 1
done
install numpy1 "numpy<2" scipy
install numpy1 "numpy<2" "pybotics==3.1.2"
install numpy1 "numpy<2" "robotkinecal==0.1.0"
install numpy2 "numpy>=2" scipy
install numpy2 "pin==4.1.0"
install numpy2 "figaroh==1.0.2" "pin==4.1.0"
