# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HTML toolkit of every report (page, charts, words), the rows that reports draw, and the text of ``result.json``."""
