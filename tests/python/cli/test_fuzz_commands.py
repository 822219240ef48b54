# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Whatever the input files hold, a command ends in time with an exit status of its contract: no crash, no
traceback, nothing left over. (`fuzz_commands` says how a single case is run again.)
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "support" / "fuzz_commands.py"


@pytest.mark.parametrize(
    ("cases", "seed"), [(500, 1), pytest.param(9500, 2, marks=pytest.mark.slow)], ids=["few", "many"]
)
def test_files_with_faults_end_in_an_answer_or_a_line(tmp_path: Path, cases: int, seed: int) -> None:
    pytest.importorskip("cv2")
    done = subprocess.run(
        [sys.executable, str(PROGRAM), str(tmp_path), "--cases", str(cases), "--seed", str(seed)],
        capture_output=True,
        check=False,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
    assert f"{cases} cases of {cases}, 0 faults" in done.stdout
