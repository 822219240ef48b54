#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds the wheel that another machine installs without a compiler or system libraries, into dist/:
#   1. Ceres from Debian's or Ubuntu's source package, static, without SuiteSparse and LAPACK: the distribution's own
#      binary brings CHOLMOD, parts of which are under the GPL;
#   2. the wheel with it, repaired by auditwheel: urdfdom and the XML readers go into it;
#   3. what is inside under which licence (scripts/licences.py), which fails on the unknown and on the GPL;
#   4. the size, and a bare system that installs it and runs `truing demo` (scripts/bare_install.sh).
#
#   scripts/wheel.sh               all of it
#   scripts/wheel.sh --no-install  without the bare system
#
# CMAKE_ARGUMENTS="-D...;-D..." are given to CMake. CERES_SOURCE=folder takes Ceres from there; it is to hold debian/copyright. PYTHON=... as in setup.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/env.sh

work=build/wheel
largest=$((8 * 1000 * 1000)) # bytes

say() { printf '[wheel] %s\n' "$*"; }

# ---- Ceres -----------------------------------------------------------------------------------------------------------

# The source package of the release that this machine's own packages come from; needs no entry in /etc/apt, nor root.
fetch_ceres() {
  local apt=$root/$work/apt keyring
  rm -rf "$apt" "$work/ceres"
  mkdir -p "$apt/lists/partial" "$apt/archives/partial" "$work/ceres"
  keyring=$(compgen -G '/usr/share/keyrings/*-archive-keyring.gpg' | grep -E '/(debian|ubuntu)-archive' | head -n 1)
  apt-cache policy libceres-dev |
    awk -v key="$keyring" '/^ *[0-9]+ https?:.*Packages$/ {
      split($3, part, "/"); print "deb-src [signed-by=" key "] " $2 " " part[1] " " part[2] }' |
    sort -u > "$apt/sources.list"
  local options=(-o "Dir::Etc::sourcelist=$apt/sources.list" -o "Dir::Etc::sourceparts=-"
    -o "Dir::State::Lists=$apt/lists" -o "Dir::Cache=$apt" -o "APT::Sandbox::User=")
  (
    cd "$work/ceres"
    apt-get "${options[@]}" update
    apt-get "${options[@]}" source ceres-solver
  ) > "$work/ceres-source.log" 2>&1 || { tail -n 20 "$work/ceres-source.log" >&2; return 1; }
}

build_ceres() {
  local source=${CERES_SOURCE:-}
  if [[ -z $source ]]; then
    [[ -n $(compgen -G "$work/ceres/ceres-solver-*/CMakeLists.txt") ]] || { say "fetching Ceres' source"; fetch_ceres; }
    source=$(dirname "$(compgen -G "$root/$work/ceres/ceres-solver-*/CMakeLists.txt")")
  fi
  printf '%s\n' "$source" > "$work/ceres.source"
  [[ ! -e $work/prefix/.made || $(< "$work/prefix/.made") != "$source" ]] || return 0
  say "building Ceres without SuiteSparse and LAPACK (a few minutes)"
  local log=$work/ceres.log
  {
    cmake -S "$source" -B "$work/ceres-build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$root/$work/prefix" \
      -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DBUILD_SHARED_LIBS=OFF -DEIGENSPARSE=ON -DMINIGLOG=ON \
      -DSUITESPARSE=OFF -DCXSPARSE=OFF -DLAPACK=OFF -DCUDA=OFF -DUSE_CUDA=OFF -DGFLAGS=OFF \
      -DSCHUR_SPECIALIZATIONS=OFF -DBUILD_TESTING=OFF -DBUILD_EXAMPLES=OFF -DBUILD_BENCHMARKS=OFF \
      -DPROVIDE_UNINSTALL_TARGET=OFF
    cmake --build "$work/ceres-build" --target install
  } > "$log" 2>&1 || { tail -n 20 "$log" >&2; return 1; }
  printf '%s\n' "$source" > "$work/prefix/.made"
}

# ---- The wheel -------------------------------------------------------------------------------------------------------

build_wheel() {
  say "building truing with it"
  rm -rf "$work/dist" "$work/repaired"
  # The linker writes down what it read: scripts/licences.py wants to know. And Eigen refuses its parts under the LGPL.
  local arguments="-DCeres_DIR=$root/$work/prefix/lib/cmake/Ceres;-DTRUING_UNITY=$unity;-DTRUING_BUILD_TESTS=OFF"
  arguments+=";-DCMAKE_CXX_FLAGS=-DEIGEN_MPL2_ONLY"
  arguments+=";-DCMAKE_MODULE_LINKER_FLAGS=-Wl,--dependency-file=$root/$work/linked.d${CMAKE_ARGUMENTS:+;$CMAKE_ARGUMENTS}"
  env "SKBUILD_CMAKE_ARGS=$arguments" "SKBUILD_BUILD_DIR=$work/build" \
    .venv/bin/python -m pip wheel --disable-pip-version-check --verbose --no-build-isolation --no-deps \
    --wheel-dir "$work/dist" . > "$work/wheel.log" 2>&1 ||
    { grep -nE 'error|Error' "$work/wheel.log" | head -n 20 >&2; tail -n 20 "$work/wheel.log" >&2; return 1; }
  PATH="$root/.venv/bin:$PATH" .venv/bin/auditwheel repair --strip --wheel-dir "$work/repaired" "$work"/dist/truing-*.whl \
    > "$work/repair.log" 2>&1 || { cat "$work/repair.log" >&2; return 1; }
}

check_size() {
  local size
  size=$(stat -c %s "$1")
  say "$(basename "$1"): $((size / 1000)) kB"
  [[ $size -le $largest ]] || { echo "wheel: larger than $((largest / 1000)) kB" >&2; return 1; }
}

scripts/setup.sh --wheel
mkdir -p "$work"
build_ceres
build_wheel
rm -rf dist
.venv/bin/python scripts/licences.py "$work"/repaired/truing-*.whl --out dist --linked "$work/linked.d" \
  --built "$work/build" --built "$work/ceres-build" \
  --ceres "$(< "$work/ceres.source")" --ceres "$work/ceres-build" --ceres "$work/prefix"
wheel=$(compgen -G 'dist/truing-*.whl')
check_size "$wheel"
[[ ${1:-} == --no-install ]] || scripts/bare_install.sh "$wheel"
