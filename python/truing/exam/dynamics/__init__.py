# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The dynamic half of the examination: recordings of motion with hidden effects on the torques that truing
has to name (docs/method/exam.md). Arms, motions, friction and noise are the examiner's own.
"""
