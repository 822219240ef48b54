#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds every bench/*.cpp, sets up the peers' environments (build/peers, about 2 GB), and runs bench/run.py. Where
# TRUING_REALDATA names the recordings of bench/README.md, torques of real arms are diagnosed beside other methods.
#
#   scripts/bench.sh             everything; the slowest peer takes several minutes
#   scripts/bench.sh --quick     without peers that take more than 20 s
#   scripts/bench.sh --no-peers  truing alone, nothing is downloaded
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/env.sh

configure "$release" -DTRUING_BUILD_BENCHMARKS=ON -DCMAKE_BUILD_TYPE=Release
cmake --build "$release" --target bench/all

# A peer that cannot be installed is reported by the bench and stops nothing.
stamp=build/peers/.made
if [[ " $* " != *" --no-peers "* ]] && ! cmp -s bench/peers/setup_peers.sh "$stamp"; then
  echo "setting up the peers in build/peers (some minutes)"
  if bench/peers/setup_peers.sh build/peers; then
    cp bench/peers/setup_peers.sh "$stamp"
  else
    echo "the peers' environments could not be made" >&2
  fi
fi

if [[ " $* " != *" --no-peers "* ]]; then
  .venv/bin/python -m pip install --quiet --disable-pip-version-check "scikit-learn>=1.5" ||
    echo "scikit-learn could not be installed" >&2
fi

mkdir -p build/run/bench
cd build/run/bench  # not the source tree: only the installed truing is to be imported
"$root/.venv/bin/python" "$root/bench/run.py" "$@"
if [[ -n ${TRUING_REALDATA:-} ]]; then
  "$root/.venv/bin/python" "$root/bench/real_dynamics.py" --rows "$root/$release/bench/bench_dynamics_rows" \
    --peers "$root/build/peers" --write "$root/docs/benchmarks/real-dynamics.md"
  "$root/.venv/bin/python" "$root/bench/real_servo.py" --peers "$root/build/peers" \
    --write "$root/docs/benchmarks/real-servo.md"
fi
