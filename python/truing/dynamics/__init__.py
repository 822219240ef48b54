# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics: from recorded motion and torque to the named cause, and back into the simulator."""
