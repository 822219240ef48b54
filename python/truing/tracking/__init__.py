# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tracking: where the tool of a swaying arm will be, from encoders, an inertial sensor and a tracker."""
