#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Generates the type stubs of truing._core from the installed module, and from these the keywords of Python's functions.
#
#   scripts/stubs.sh           writes python/truing/_core.pyi and _keywords.pyi
#   scripts/stubs.sh --check   fails when the committed stubs differ
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
committed=$root/python/truing
fresh=$root/build/stubs/truing

rm -rf build/stubs
mkdir -p build/stubs
# Not from here: the source tree's python/ must not be what is imported.
(cd build/stubs && "$root/.venv/bin/python" -m pybind11_stubgen truing._core --output-dir . --exit-code)
[[ -e $fresh/_core.pyi ]] ||
  { echo "stubs: no single file _core.pyi was generated; does _core have submodules?" >&2; exit 1; }
"$root/.venv/bin/python" python/bindings/keyword_stubs.py "$fresh/_core.pyi" "$fresh/_keywords.pyi"

for stub in _core.pyi _keywords.pyi; do
  if [[ ${1:-} != --check ]]; then
    cp "$fresh/$stub" "$committed/$stub"
    echo "stubs: wrote python/truing/$stub"
  elif diff -u "$committed/$stub" "$fresh/$stub"; then
    echo "stubs: python/truing/$stub is up to date"
  else
    echo "stubs: python/truing/$stub is not what the module says; run 'make stubs' and commit it" >&2
    exit 1
  fi
done
