# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Pages in headless Chromium, where it is installed."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

WAIT = 8000  # [ms] of the page's own time, which passes as fast as there is nothing to do


def dom_of(page: Path, *more: str) -> str:
    """What the page is after its script ran. `more`: options of Chromium. Skips where there is none."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium is installed")
    with tempfile.TemporaryDirectory() as profile:
        arguments = [
            "--headless",
            "--no-sandbox",
            "--enable-unsafe-swiftshader",  # WebGL without a graphics card
            f"--user-data-dir={profile}",
            f"--virtual-time-budget={WAIT}",
            *more,
            "--dump-dom",
        ]
        done = subprocess.run(
            [browser, *arguments, page.absolute().as_uri()], capture_output=True, check=False, timeout=180
        )
    assert done.returncode == 0, done.stderr.decode()[-2000:]
    return done.stdout.decode()
