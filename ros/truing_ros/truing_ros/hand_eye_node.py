# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Publishes the result of ``truing handeye`` on /tf_static.

    ros2 run truing_ros hand_eye_frames --ros-args -p result:=truing-handeye/result.json \
        -p hand_frame:=tool0 -p base_frame:=base_link -p camera_frame:=camera_color_optical_frame
"""

from __future__ import annotations

import sys

import rclpy
import rclpy.time
import tf2_ros
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node

from truing_ros import hand_eye
from truing_ros.frames import Frame, fill, frame_of

LOOK_EVERY = 0.5  # [s] for the frames of the camera's driver


class HandEyeFrames(Node):
    """The camera in the hand or the base; the board too where `board_frame` names it.

    A driver that publishes frames of its own camera already gives the optical frame a parent, and a frame has
    but one. `attach` is then the root of the driver's frames (``camera_link``): that one is published, so
    that the optical frame comes to be where it was found.
    """

    def __init__(self) -> None:
        super().__init__("hand_eye_frames")
        defaults = {"hand": "tool0", "base": "base_link"}
        parents = {
            name: self.declare_parameter(f"{name}_frame", value).value for name, value in defaults.items()
        }
        self._camera = self.declare_parameter("camera_frame", "camera_color_optical_frame").value
        self._attach = self.declare_parameter("attach", "").value
        board = self.declare_parameter("board_frame", "").value
        found = hand_eye.read(self.declare_parameter("result", "truing-handeye/result.json").value)

        self._broadcaster = tf2_ros.StaticTransformBroadcaster(self)
        self._transforms: list[TransformStamped] = []
        if board:
            self._publish(parents[found.board_in], board, found.T_parent_board)
        self._parent, self._T_parent_camera = parents[found.camera_in], found.T_parent_camera
        if not self._attach or self._attach == self._camera:
            self._publish(self._parent, self._camera, self._T_parent_camera)
            return
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, self)
        self._timer = self.create_timer(LOOK_EVERY, self.look)

    def look(self) -> None:
        """Publishes the root of the driver's frames as soon as it is known where the camera is in it."""
        try:
            driver = self._buffer.lookup_transform(self._attach, self._camera, rclpy.time.Time()).transform
        except tf2_ros.TransformException as error:
            self.get_logger().warning(
                f"waiting for {self._camera} in {self._attach}, which the camera's driver publishes: {error}",
                throttle_duration_sec=10.0,
            )
            return
        T_attach_camera = frame_of(driver.translation, driver.rotation)
        self._timer.cancel()
        self._publish(self._parent, self._attach, self._T_parent_camera * T_attach_camera.inverse())

    def _publish(self, parent: str, child: str, frame: Frame) -> None:
        transform = TransformStamped()
        transform.header.stamp = self.get_clock().now().to_msg()
        transform.header.frame_id, transform.child_frame_id = parent, child
        fill(transform.transform, frame)
        self._transforms.append(transform)
        self._broadcaster.sendTransform(self._transforms)
        self.get_logger().info(f"{child} in {parent}: {frame.position.round(6).tolist()} m")


def main() -> int:
    rclpy.init(args=sys.argv)
    try:
        rclpy.spin(HandEyeFrames())
    except ValueError as error:
        print(f"hand_eye_frames: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()
    return 0
