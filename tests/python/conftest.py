# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What every test relies on."""

import signal

# A shell starts what it puts into the background with Ctrl-C ignored, and whatever that starts inherits it.
# The tests of Ctrl-C are to hold there too.
signal.signal(signal.SIGINT, signal.default_int_handler)
