#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds the script of the reports, python/truing/report/report.js, from web/src and the packages of package-lock.json.
# Needed only after a change here: what it writes is committed, and neither the build nor the tests of truing need node.
#
#   web/build.sh           writes report.js and licences.txt
#   web/build.sh --check   says whether the committed ones are what the sources give; status 1 if they are not
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
report=../python/truing/report

command -v npm > /dev/null || { echo "web/build.sh: node and npm are needed (Debian: apt-get install nodejs npm)" >&2; exit 2; }
# Of the packages' own install scripts none is run; esbuild's binary is a package of its own.
npm ci --ignore-scripts --no-audit --no-fund --loglevel=error > /dev/null

if [[ ${1:-} == --check ]]; then
  out=$(mktemp -d)
  trap 'rm -rf "$out"' EXIT
  node build.mjs "$out/report.js" > /dev/null
  for file in report.js licences.txt; do
    cmp -s "$out/$file" "$report/$file" || { echo "web/build.sh: $file is not what web/src gives: run web/build.sh" >&2; exit 1; }
  done
  echo "web/build.sh: report.js and licences.txt are what web/src gives"
else
  node build.mjs "$report/report.js"
fi
