# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Planning of measurements: which poses to measure, and which effects they tell apart."""
