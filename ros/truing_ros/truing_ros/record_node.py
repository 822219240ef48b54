# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Records joint states beside the poses of a tracker or camera as truing's CSV files.

    ros2 run truing_ros record --ros-args -p kind:=measurements -p joints:="[J1, J2, J3, J4, J5, J6]" \
        -p pose_topic:=/tracker/pose -p file:=measurements.csv
    ros2 service call /record/take std_srvs/srv/Trigger
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import rclpy
import rclpy.time
import tf2_ros
from geometry_msgs.msg import PointStamped, PoseStamped, TransformStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from truing_ros.frames import Frame, frame_of
from truing_ros.recording import Joints, NotTaken, Rows, Streams

TICK = 0.1  # [s] how often /tf is looked at, and whether the arm stands still
KINDS = ("measurements", "handeye", "streams")
MESSAGES = {"pose": PoseStamped, "transform": TransformStamped, "point": PointStamped}


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


class Record(Node):
    """Parameters: docs/guide/ros.md."""

    def __init__(self) -> None:
        super().__init__("record")

        def parameter(name: str, otherwise: Any) -> Any:
            return self.declare_parameter(name, otherwise).value

        self._kind = parameter("kind", "measurements")
        if self._kind not in KINDS:
            raise ValueError(f"kind: found {self._kind!r}, expected one of {', '.join(KINDS)}")
        pose_type = parameter("pose_type", "pose")
        if pose_type not in (*MESSAGES, "tf"):
            raise ValueError(f"pose_type: found {pose_type!r}, expected one of {', '.join(MESSAGES)}, tf")
        joints = Joints(
            [name for name in parameter("joints", [""]) if name],
            [name for name in parameter("prismatic", [""]) if name],
        )
        names = {"measurements": "measurements.csv", "handeye": "poses.csv", "streams": "streams"}
        path = Path(parameter("file", names[self._kind]))
        oriented = pose_type != "point"
        window, still = parameter("window", 1.0), parameter("still", 2e-3)
        self.recorder: Rows | Streams = (
            Streams(path, joints, oriented=oriented)
            if self._kind == "streams"
            else Rows(path, self._kind, joints, oriented=oriented, window=window, still=still)
        )
        self._hand = (parameter("base_frame", "base_link"), parameter("hand_frame", "tool0"))
        self._measured = (
            parameter("pose_parent", "camera_color_optical_frame"),
            parameter("pose_child", "board"),
        )
        self._least_motion = parameter("auto", 0.0)
        self._last_stamp = 0
        if pose_type == "tf" or self._kind == "handeye":
            self._buffer = tf2_ros.Buffer()
            self._listener = tf2_ros.TransformListener(self._buffer, self)
        self.create_subscription(
            JointState, parameter("joint_topic", "joint_states"), self.on_joints, qos_profile_sensor_data
        )
        topic = parameter("pose_topic", "pose")
        if pose_type != "tf":
            self.create_subscription(MESSAGES[pose_type], topic, self.on_pose, qos_profile_sensor_data)
        if pose_type == "tf":
            self.create_timer(TICK, self.look)
        if self._kind != "streams":
            self.create_service(Trigger, "~/take", self.on_take)
            if self._least_motion > 0.0:
                self.create_timer(TICK, self.take_when_still)
        self.get_logger().info(f"writing {path}")

    # ---- What comes in ---------------------------------------------------------------------------

    def on_joints(self, message: JointState) -> None:
        stamp = _nanoseconds(message.header.stamp)
        self.recorder.on_joints(stamp, message.name, message.position, self._now())

    def on_pose(self, message: Any) -> None:
        try:
            frame = _frame_of(message)
        except ValueError as error:
            self.get_logger().warning(f"a message {error}", throttle_duration_sec=5.0)
            return
        self.recorder.on_pose(_nanoseconds(message.header.stamp), frame, self._now())

    def look(self) -> None:
        """The pose as /tf has it, where it is a new one."""
        message = self._latest(*self._measured)
        if message is not None and _nanoseconds(message.header.stamp) > self._last_stamp:
            self._last_stamp = _nanoseconds(message.header.stamp)
            self.on_pose(message)

    # ---- What goes out ---------------------------------------------------------------------------

    def on_take(self, request: Any, response: Any) -> Any:
        try:
            response.message, response.success = self._take(), True
        except NotTaken as error:
            response.message, response.success = str(error), False
        return response

    def take_when_still(self) -> None:
        """A row as soon as the arm stands still somewhere else."""
        recorder = self.recorder
        if not isinstance(recorder, Rows) or not recorder.moved(self._now(), self._least_motion):
            return
        try:
            self.get_logger().info(self._take())
        except NotTaken as error:
            self.get_logger().debug(str(error))

    def _take(self) -> str:
        assert isinstance(self.recorder, Rows)
        hand = None
        if self._kind == "handeye":
            message = self._latest(*self._hand)
            hand = None if message is None else _frame_of(message)
        return self.recorder.take(self._now(), hand)

    def _latest(self, parent: str, child: str) -> TransformStamped | None:
        try:
            return self._buffer.lookup_transform(parent, child, rclpy.time.Time())
        except tf2_ros.TransformException as error:
            self.get_logger().warning(f"{child} in {parent}: {error}", throttle_duration_sec=5.0)
            return None

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)


def _frame_of(message: Any) -> Frame:
    if isinstance(message, PoseStamped):
        return frame_of(message.pose.position, message.pose.orientation)
    if isinstance(message, TransformStamped):
        return frame_of(message.transform.translation, message.transform.rotation)
    return frame_of(message.point, TransformStamped().transform.rotation)


def main() -> int:
    rclpy.init(args=sys.argv)
    node = None
    try:
        node = Record()
        rclpy.spin(node)
    except (ValueError, OSError) as error:
        print(f"record: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        pass
    finally:
        if node is not None:
            node.recorder.close()
        rclpy.try_shutdown()
    return 0
