# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The camera where truing found it: ``ros2 launch truing_ros hand_eye.launch.py result:=FILE``."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "result": ("truing-handeye/result.json", "result.json of truing handeye, or its folder"),
    "hand_frame": ("tool0", "the flange that the robot's poses were of"),
    "base_frame": ("base_link", "the robot base that they were in"),
    "camera_frame": ("camera_color_optical_frame", "the camera's optical frame: z forward, x right"),
    "attach": ("", "root of the frames that the camera's driver publishes, such as camera_link"),
    "board_frame": ("", "a name: the board is published too"),
}


def generate_launch_description() -> LaunchDescription:
    declared = [
        DeclareLaunchArgument(name, default_value=value, description=about)
        for name, (value, about) in ARGUMENTS.items()
    ]
    node = Node(
        package="truing_ros",
        executable="hand_eye_frames",
        output="screen",
        parameters=[{name: LaunchConfiguration(name) for name in ARGUMENTS}],
    )
    return LaunchDescription([*declared, node])
