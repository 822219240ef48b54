# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis: where the gap between robot and model lies, and which effect causes it."""
