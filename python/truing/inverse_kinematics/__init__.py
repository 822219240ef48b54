# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Inverse kinematics and compensation: joints for targets, targets that make up for the robot's errors."""
