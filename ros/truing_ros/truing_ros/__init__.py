# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""truing in ROS 2: what the nodes compute (`hand_eye`, `recording`), and the nodes (`*_node`)."""
