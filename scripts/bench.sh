#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds every bench/*.cpp, sets up the peers' environments (build/peers, about 2 GB), and runs bench/run.py.
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

mkdir -p build/run/bench
cd build/run/bench  # not the source tree: only the installed truing is to be imported
"$root/.venv/bin/python" "$root/bench/run.py" "$@"
