# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Stand-ins for the modules of ROS 2 that ros/truing_ros uses, written for the tests: messages with their
fields, a node whose clock, parameters, topics and frames the test holds in its hands. No ROS is needed, and
none is tested.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "ros" / "truing_ros"


def message(name: str, /, **fields: Callable[[], Any]) -> type:
    """A class whose objects have these fields, each made anew."""

    def start(self: Any, **values: Any) -> None:
        for field, make in fields.items():
            setattr(self, field, values[field] if field in values else make())

    return type(name, (), {"__init__": start})


Time = message("Time", sec=int, nanosec=int)
Header = message("Header", stamp=Time, frame_id=str)
Point = message("Point", x=float, y=float, z=float)
Quaternion = message("Quaternion", x=float, y=float, z=float, w=lambda: 1.0)
Pose = message("Pose", position=Point, orientation=Quaternion)
Transform = message("Transform", translation=Point, rotation=Quaternion)
PoseStamped = message("PoseStamped", header=Header, pose=Pose)
PointStamped = message("PointStamped", header=Header, point=Point)
TransformStamped = message("TransformStamped", header=Header, child_frame_id=str, transform=Transform)
JointState = message("JointState", header=Header, name=list, position=list, velocity=list, effort=list)


class World:
    """What is around the nodes of one test."""

    def __init__(self) -> None:
        self.now = 1_700_000_000_000_000_000  # [ns]
        self.parameters: dict[str, Any] = {}
        self.frames: dict[tuple[str, str], Any] = {}  # by parent and child
        self.static: dict[str, Any] = {}  # what was sent to /tf_static, by child
        self.log: list[str] = []

    def stamp(self) -> Any:
        return Time(sec=self.now // 1_000_000_000, nanosec=self.now % 1_000_000_000)


class TransformException(Exception):
    pass


def _node_of(world: World) -> type:
    class Node:
        def __init__(self, name: str) -> None:
            self.subscriptions: dict[str, Any] = {}
            self.services: dict[str, Any] = {}
            self.timers: list[Any] = []
            self._declared: set[str] = set()

        def declare_parameter(self, name: str, value: Any) -> Any:
            assert name not in self._declared, f"{name} was declared already"
            self._declared.add(name)
            given = world.parameters.get(name, value)
            assert type(given) is type(value), f"{name}: rclpy refuses another type than that of the default"
            return SimpleNamespace(value=given)

        def create_subscription(self, kind: type, topic: str, callback: Any, profile: Any) -> None:
            self.subscriptions[topic] = callback

        def create_service(self, kind: type, name: str, callback: Any) -> None:
            self.services[name] = callback

        def create_timer(self, period: float, callback: Any) -> Any:
            timer = SimpleNamespace(callback=callback, running=True)
            timer.cancel = lambda: setattr(timer, "running", False)
            self.timers.append(timer)
            return timer

        def tick(self) -> None:
            for timer in self.timers:
                if timer.running:
                    timer.callback()

        def get_clock(self) -> Any:
            return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=world.now, to_msg=world.stamp))

        def get_logger(self) -> Any:
            def say(text: str, throttle_duration_sec: float = 0.0) -> None:
                world.log.append(text)

            return SimpleNamespace(info=say, warning=say, debug=say)

    return Node


def _tf2_of(world: World) -> ModuleType:
    class Buffer:
        def lookup_transform(self, parent: str, child: str, time: Any) -> Any:
            if (parent, child) not in world.frames:
                raise TransformException(f"{child} is not known in {parent}")
            return world.frames[parent, child]

    class StaticTransformBroadcaster:
        def __init__(self, node: Any) -> None:
            pass

        def sendTransform(self, transforms: list[Any]) -> None:  # noqa: N802 (its name)
            world.static = {transform.child_frame_id: transform for transform in transforms}

    return _module(
        "tf2_ros",
        Buffer=Buffer,
        TransformListener=lambda buffer, node: None,
        StaticTransformBroadcaster=StaticTransformBroadcaster,
        TransformException=TransformException,
    )


def _module(name: str, **contents: Any) -> ModuleType:
    module = ModuleType(name)
    vars(module).update(contents)
    return module


def install(monkeypatch: pytest.MonkeyPatch) -> World:
    """The stand-ins and ros/truing_ros become importable, for one test."""
    world = World()
    time = _module("rclpy.time", Time=object)
    node = _module("rclpy.node", Node=_node_of(world))
    qos = _module("rclpy.qos", qos_profile_sensor_data=object())
    rclpy = _module("rclpy", time=time, node=node, qos=qos, init=lambda args: None, try_shutdown=lambda: None)
    geometry = _module(
        "geometry_msgs.msg",
        PoseStamped=PoseStamped,
        PointStamped=PointStamped,
        TransformStamped=TransformStamped,
    )
    modules = [
        rclpy,
        time,
        node,
        qos,
        _module("geometry_msgs", msg=geometry),
        geometry,
        _module("sensor_msgs"),
        _module("sensor_msgs.msg", JointState=JointState),
        _module("std_srvs"),
        _module("std_srvs.srv", Trigger=object),
        _tf2_of(world),
    ]
    for module in modules:
        monkeypatch.setitem(sys.modules, module.__name__, module)
    for name in [name for name in sys.modules if name.split(".")[0] == "truing_ros"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(str(PACKAGE))
    return world
