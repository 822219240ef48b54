# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Find how a real robot differs from its model, name the cause, and remove it."""
