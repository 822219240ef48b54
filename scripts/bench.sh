#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds and runs the benchmarks: every bench/*.cpp, then every bench/*.py.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
export CMAKE_BUILD_PARALLEL_LEVEL=${JOBS:-$(nproc)} CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}
shopt -s nullglob

cmake -S . -B build/bench -DTRUING_BUILD_TESTS=OFF -DTRUING_BUILD_BENCHMARKS=ON -DCMAKE_BUILD_TYPE=Release > /dev/null
cmake --build build/bench
mkdir -p build/run/bench
cd build/run/bench
for source in "$root"/bench/*.cpp; do
  name=$(basename "$source" .cpp)
  printf '\n==== bench/%s.cpp ====\n' "$name"
  "$root/build/bench/bench_$name"
done
for source in "$root"/bench/*.py; do
  printf '\n==== bench/%s ====\n' "$(basename "$source")"
  "$root/.venv/bin/python" "$source"
done
