"""What Foxglove is offered: scenes in its own schemas, and our messages with theirs. Pure.

A channel is logged to only while somebody subscribes to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec
from foxglove import Channel, Context, Schema
from foxglove.channels import FrameTransformsChannel, PosesInFrameChannel, SceneUpdateChannel

from rhot import topics
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.hand import HandName
from rhot.messages import HandPose
from rhot.messages.json_schema import json_schema
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.topics import Topic
from services.bridges.foxglove.encode import hand_scene, joint_poses, shapes, transforms


class Channels:
    """All channels of a rig."""

    def __init__(
        self, config: RigConfig, context: Context, meshes: Mapping[str, bytes] | None = None
    ) -> None:
        """meshes are GLB files in metres by the objects' names."""
        self._tables: dict[str, ObjectTable] = {table.name: table for table in config.object}
        self._meshes = meshes or {}
        self._transforms = FrameTransformsChannel("/tf", context=context)
        self._hands = SceneUpdateChannel("/hands", context=context)
        self._shapes = SceneUpdateChannel("/objects", context=context)
        self._joints: dict[HandName, PosesInFrameChannel] = {
            hand: PosesInFrameChannel(f"/hand/{hand}/joints", context=context)
            for hand in config.hand
        }
        self._messages: dict[str, Channel] = {}
        for hand in config.hand:
            self._offer(topics.POSE, HandPose, context, hand=hand)
        for name in self._tables:
            self._offer(topics.OBJECT, ObjectPose, context, object=name)
            self._offer(topics.CONTACTS, ObjectContacts, context, object=name)

    def _offer(self, topic: Topic[Any], kind: type, context: Context, **names: str) -> None:
        name = topic.template.format(**names)
        schema = Schema(name=f"rhot.{kind.__name__}", encoding="jsonschema", data=json_schema(kind))
        self._messages[name] = Channel(
            f"/rhot/{name}", schema=schema, message_encoding="json", context=context
        )

    def hands(self, poses: list[HandPose], objects: list[ObjectPose]) -> None:
        """New poses of hands and objects."""
        stamps = [hand.stamp_ns for hand in poses] + [one.stamp_ns for one in objects]
        newest_ns = max(stamps, default=0)
        if self._transforms.has_sinks():
            self._transforms.log(transforms(poses, objects), log_time=newest_ns)
        if poses and self._hands.has_sinks():
            self._hands.log(hand_scene(poses), log_time=newest_ns)
        for hand in poses:
            channel = self._joints.get(hand.hand)
            if channel is not None and channel.has_sinks():
                channel.log(joint_poses(hand), log_time=hand.stamp_ns)
            self.message(topics.POSE, hand)
        for one in objects:
            self.message(topics.OBJECT, one)

    def shapes(self, objects: list[ObjectPose]) -> None:
        """What objects look like."""
        if objects and self._shapes.has_sinks():
            newest_ns = max(one.stamp_ns for one in objects)
            message = shapes(objects, self._tables, self._meshes)
            self._shapes.log(message, log_time=newest_ns)

    def message(self, topic: Topic[Any], message: HandPose | ObjectPose | ObjectContacts) -> None:
        """One of our own messages, as the bus has it."""
        name = topic.template.format(**{field: getattr(message, field) for field in topic.fields})
        channel = self._messages.get(name)
        if channel is not None and channel.has_sinks():
            channel.log(msgspec.json.encode(message), log_time=message.stamp_ns)
