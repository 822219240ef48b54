#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Generates the type stubs of truing._core from the installed module.
#
#   scripts/stubs.sh           writes python/truing/_core.pyi
#   scripts/stubs.sh --check   fails when the committed stubs differ
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
committed=$root/python/truing/_core.pyi
fresh=$root/build/stubs/truing/_core.pyi

rm -rf build/stubs
mkdir -p build/stubs
# Not from here: the source tree's python/ must not be what is imported.
(cd build/stubs && "$root/.venv/bin/python" -m pybind11_stubgen truing._core --output-dir . --exit-code)
[[ -e $fresh ]] || { echo "stubs: no single file _core.pyi was generated; does _core have submodules?" >&2; exit 1; }

if [[ ${1:-} == --check ]]; then
  if ! diff -u "$committed" "$fresh"; then
    echo "stubs: python/truing/_core.pyi is not what the module says; run 'make stubs' and commit it" >&2
    exit 1
  fi
  echo "stubs: python/truing/_core.pyi is up to date"
else
  cp "$fresh" "$committed"
  echo "stubs: wrote python/truing/_core.pyi"
fi
