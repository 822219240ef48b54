# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Robot programs of five makers: where their literal targets stand, byte by byte, and why others are left."""
