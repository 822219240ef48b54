#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds the documentation site into build/site: open build/site/index.html. A warning is an error, and so is a page that
# would fetch anything from elsewhere. What it needs is the extra `docs` of pyproject.toml; what of it is missing in .venv is
# installed there.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=$PWD/.venv/bin/python

if ! "$python" -c 'import mkdocs, material, mkdocstrings_handlers.python' 2> /dev/null; then
  mapfile -t packages < <("$python" - << 'PYTHON'
try:
    import tomllib
except ImportError:  # Python 3.10
    from pip._vendor import tomli as tomllib
with open("pyproject.toml", "rb") as file:
    print("\n".join(tomllib.load(file)["project"]["optional-dependencies"]["docs"]))
PYTHON
  )
  "$python" -m pip install --quiet --disable-pip-version-check "${packages[@]}"
fi

NO_MKDOCS_2_WARNING=1 "$python" -m mkdocs build --strict --quiet
"$python" scripts/site_check.py build/site
