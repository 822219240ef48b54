# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say why a robot's torques differ from its model, from recordings of motion."""

PANEL = "Dynamics"
