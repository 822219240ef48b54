# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which build of truing answers: a fingerprint of everything that it computes with."""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
from pathlib import Path

_CODE = (".py", *importlib.machinery.EXTENSION_SUFFIXES)


def package_build(folder: Path | None = None) -> str:
    """SHA-256 of all Python files and compiled modules of a package, names included. folder: of the package;
    None: the truing that is imported here.
    """
    root = folder or _installed()
    files = {path.relative_to(root).as_posix(): path for path in root.rglob("*") if path.name.endswith(_CODE)}
    digest = hashlib.sha256()
    for name in sorted(files):
        content = hashlib.sha256(files[name].read_bytes()).hexdigest()
        digest.update(f"{name} {content}\n".encode())
    return digest.hexdigest()


def _installed() -> Path:
    found = importlib.util.find_spec("truing")
    if found is None or found.origin is None:
        raise RuntimeError("the package truing is not found")
    return Path(found.origin).parent
