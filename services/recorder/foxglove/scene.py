"""Hands and objects as Foxglove and Rerun draw them, made of our own messages. Pure.

Beside each hand pose goes a frame for each joint (foxglove.FrameTransforms) and a skeleton
(foxglove.SceneUpdate), beside each object's pose its frame; the object's shape stands once in a
file, in that frame. All frames hang on `rig`, which hangs on `world`, whose z is up. What does not
decode has no picture.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.hand import CHAIN_JOINTS, JOINT_INDEX, JOINTS
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose
from rhot.topics import Topic
from services.recorder.foxglove import wire

TRANSFORMS, SCENE = "foxglove.FrameTransforms", "foxglove.SceneUpdate"
WORLD, RIG = "world", "rig"
# A hand that is lost is gone: as on the page, but sooner, as nobody says that it is.
_HAND_LIFE_NS = 500_000_000
_BONE_M = 0.004
# Okabe and Ito's colours, which everybody can tell apart.
_SOURCES: Mapping[str, wire.Rgba] = {
    "measured": (0.0, 0.62, 0.45, 1.0),
    "solved": (0.0, 0.45, 0.7, 1.0),
    "predicted": (0.6, 0.6, 0.6, 1.0),
}
_OBJECT_RGBA = (0.9, 0.62, 0.01, 0.6)
# Positions to a micrometre and turns to a millionth, as multiples of a power of two: the zeros at
# the end of such doubles compress (7.2 -> 5.5 MB/min of a hand and an object).
_STEPS = 2.0**20
_STRAIGHT = (1.0, 0.0, 0.0, 0.0)
# A quarter turn about x: an upright camera's -y becomes z, and an object's y the cylinder's axis.
_HALF = 0.5**0.5
_UP_FROM_CAMERA = (_HALF, -_HALF, 0.0, 0.0)
_MEDIA = {".glb": "model/gltf-binary", ".stl": "model/stl"}
# From the wrist along each digit.
_CHAINS = [
    [JOINT_INDEX["wrist"], *([] if row == 0 else [chain[0] - 1]), *chain]
    for row, chain in enumerate(CHAIN_JOINTS.tolist())
]


class Drawn(NamedTuple):
    """A message for Foxglove: channel, schema, bytes."""

    channel: str
    schema: str
    data: bytes


class FoxgloveScene:
    """What of a rig is drawn; meshes are files by name, as attachments have them."""

    def __init__(self, config: RigConfig, meshes: Mapping[str, bytes]) -> None:
        self._up = _UP_FROM_CAMERA if config.rig.world is None else _STRAIGHT
        self._tables = {table.name: table for table in config.object}
        self._meshes = meshes
        self._poses = msgspec.json.Decoder(HandPose)
        self._objects = msgspec.json.Decoder(ObjectPose)
        self._shown: set[str] = set()

    def of(self, topic: Topic, payload: bytes) -> Iterator[Drawn]:
        """What is drawn of one message."""
        try:
            if topic is topics.POSE:
                pose = self._poses.decode(payload)
                yield from self._with_world(pose.stamp_ns)
                yield from _hand(pose)
            elif topic is topics.OBJECT:
                found = self._objects.decode(payload)
                if found.registered and found.tracking not in ("lost", "unregistered"):
                    yield from self._with_world(found.stamp_ns)
                    yield from self._object(found)
        except UNDECODABLE:
            return

    def _with_world(self, stamp_ns: int) -> Iterator[Drawn]:
        if WORLD not in self._shown:
            self._shown.add(WORLD)
            stamp = wire.timestamp(stamp_ns)
            up = wire.frame_transform(stamp, WORLD, RIG, (0.0, 0.0, 0.0), self._up)
            yield Drawn("foxglove/world", TRANSFORMS, up)

    def _object(self, pose: ObjectPose) -> Iterator[Drawn]:
        stamp, frame = wire.timestamp(pose.stamp_ns), f"object_{pose.object}"
        at = (_rounded(pose.position_m), _rounded(pose.orientation_wxyz))
        where = wire.frame_transform(stamp, RIG, frame, *at)
        yield Drawn(f"foxglove/object/{pose.object}/frame", TRANSFORMS, where)
        table = self._tables.get(pose.object)
        if table is not None and frame not in self._shown:
            self._shown.add(frame)
            shape = wire.scene_update(stamp, frame, frame, self._shape(table))
            yield Drawn(f"foxglove/object/{pose.object}", SCENE, shape)

    def _shape(self, table: ObjectTable) -> bytes:
        at = wire.pose((0.0, 0.0, 0.0), _STRAIGHT)
        suffix = Path(table.mesh).suffix.lower()
        mesh = self._meshes.get(f"meshes/{table.name}{suffix}")
        if table.shape == "mesh" and mesh is not None:
            return wire.model(at, mesh, _MEDIA.get(suffix, ""))
        if table.shape == "box":
            return wire.cube(at, table.size_m, _OBJECT_RGBA)
        if table.shape == "cylinder":
            # Ours stands along y, Foxglove's along z.
            upright = wire.pose((0.0, 0.0, 0.0), _UP_FROM_CAMERA)
            diameter_m, height_m = table.size_m
            return wire.cylinder(upright, diameter_m, height_m, _OBJECT_RGBA)
        # Of an unknown shape, a ball as large as a tracker.
        ball_m = table.size_m[0] if table.shape == "sphere" else 0.03
        return wire.sphere(at, ball_m, _OBJECT_RGBA)


def _rounded(values: Iterable[float]) -> list[float]:
    return [round(value * _STEPS) / _STEPS for value in values]


def _hand(pose: HandPose) -> Iterator[Drawn]:
    stamp = wire.timestamp(pose.stamp_ns)
    positions_m = [_rounded(joint.position_m) for joint in pose.joints]
    frames = b"".join(
        wire.frame_transform(
            stamp, RIG, f"{pose.hand}_{name}", position_m, _rounded(joint.orientation_wxyz)
        )
        for name, joint, position_m in zip(JOINTS, pose.joints, positions_m, strict=True)
    )
    yield Drawn(f"foxglove/hand/{pose.hand}/frames", TRANSFORMS, frames)
    spheres = b"".join(
        wire.sphere(wire.pose(position_m, _STRAIGHT), 1.4 * joint.radius_m, _SOURCES[joint.source])
        for joint, position_m in zip(pose.joints, positions_m, strict=True)
    )
    origin = wire.pose((0.0, 0.0, 0.0), _STRAIGHT)
    bones = b"".join(
        wire.line_strip(
            origin,
            [positions_m[index] for index in chain],
            _BONE_M,
            _SOURCES[pose.joints[chain[-1]].source],
        )
        for chain in _CHAINS
    )
    skeleton = wire.scene_update(
        stamp, RIG, f"{pose.hand}_hand", spheres + bones, lifetime_ns=_HAND_LIFE_NS
    )
    yield Drawn(f"foxglove/hand/{pose.hand}", SCENE, skeleton)


def scene_of(attachments: Mapping[str, bytes]) -> FoxgloveScene | None:
    """The scene of a recording with these attachments, None if its rig wants none."""
    try:
        config = msgspec.json.decode(attachments["config.json"], type=RigConfig)
    except (KeyError, *UNDECODABLE):
        return None
    return FoxgloveScene(config, attachments) if config.recorder.foxglove else None


def schema(name: str) -> bytes:
    """The FileDescriptorSet of TRANSFORMS or SCENE, as Foxglove publishes it."""
    return (Path(__file__).parent / f"{name.removeprefix('foxglove.')}.bin").read_bytes()
