# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye calibration: where a camera or a board sits on the robot."""
