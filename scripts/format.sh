#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# The format of the sources, what ruff finds, and how long and how branched a function may be.
#
#   scripts/format.sh           formats in place
#   scripts/format.sh --check   fails when something is not formatted, or a rule is broken
#
# The tools come with `scripts/setup.sh --test`, in the versions that pyproject.toml pins.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tools=${TRUING_TOOLS:-.venv/bin}

mapfile -t cpp_files < <(git ls-files --cached --others --exclude-standard '*.cpp' '*.hpp' | sort -u)

if [[ ${1:-} != --check ]]; then
  "$tools/clang-format" -i "${cpp_files[@]}"
  "$tools/ruff" format
  exit
fi

failed=0
complain() {
  printf 'format: %s\n' "$1" >&2
  failed=1
}

"$tools/clang-format" --dry-run -Werror "${cpp_files[@]}" || complain "clang-format would change C++ files: make format"
"$tools/ruff" format --check || complain "ruff would change Python files: make format"
"$tools/ruff" check || complain "ruff found something"

# No function above 80 lines or cyclomatic complexity 25.
"$tools/lizard" --length 80 --CCN 25 --warnings_only --exclude "*/report/report.js" cpp python bench ros web/src ||
  complain "functions above 80 lines or cyclomatic complexity 25: make steps of them"

exit "$failed"
