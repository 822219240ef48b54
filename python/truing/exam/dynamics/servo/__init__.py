# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servo arms in the dynamic half of the examination: what was commanded and where the arm went, no torques.
Firmware, gears and friction are the examiner's own (docs/method/exam.md).
"""
