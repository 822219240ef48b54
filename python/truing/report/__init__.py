# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What reports are made with: page, charts, words; the rows that they draw; the text of ``result.json``."""
