# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The examination: robots with hidden effects that truing has to name, and laws that are not truing's own
(docs/method/exam.md).

    from truing.exam.run import run_exam
    from truing.exam.score import plain

    print(plain(run_exam("development", quick=True)))

It needs MuJoCo: `pip install truing[exam]`.
"""
