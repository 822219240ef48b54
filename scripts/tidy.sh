#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# clang-tidy with the rules of .clang-tidy over cpp/, or over the files that are named.
#
#   scripts/tidy.sh [cpp/src/math/registration.cpp ...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/env.sh

version=20.1.0
[[ $(.venv/bin/clang-tidy --version 2> /dev/null) == *"$version"* ]] ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check "clang-tidy==$version"
configure "$release" -DTRUING_BUILD_TESTS=ON -DCMAKE_BUILD_TYPE=Release

files=("$@")
[[ ${#files[@]} -gt 0 ]] || mapfile -t files < <(git ls-files 'cpp/src/*.cpp')
printf '%s\0' "${files[@]}" | xargs -0 -n 1 -P "$jobs" .venv/bin/clang-tidy --quiet -p "$release"
