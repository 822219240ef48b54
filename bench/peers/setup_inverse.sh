#!/bin/sh
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
# Make the environment of the peers of bench/inverse.py:  ./setup_inverse.sh DIR
# A peer that cannot be installed or built does not stop the others: bench/inverse.py reports it as missing.
# Pinocchio's headers take a compiler about six minutes.
set -u
dir=${1:?usage: setup_inverse.sh DIR}
here=$(dirname "$0")
python=${PYTHON:-python3}

[ -x "$dir/bin/python" ] || "$python" -m venv "$dir" || exit 1
grep -v '^#' "$here/requirements-inverse.txt" | while read -r package; do
    "$dir/bin/python" -m pip install --quiet --disable-pip-version-check "numpy<2.3" "$package" || echo "could not install: $package" >&2
done

# Closed-loop inverse kinematics on Pinocchio's C++ library, as it comes in the wheel.
prefix=$("$dir/bin/python" -c 'import pinocchio, pathlib; print(pathlib.Path(pinocchio.__file__).parents[4])') || exit 1
"${CXX:-c++}" -std=c++17 -O3 -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
    -isystem "$prefix/include" -isystem "$prefix/include/eigen3" "$here/pinocchio_clik.cpp" -o "$dir/bin/pinocchio_clik" \
    -L"$prefix/lib" -lpinocchio_default -Wl,-rpath,"$prefix/lib" || echo "could not build pinocchio_clik" >&2
