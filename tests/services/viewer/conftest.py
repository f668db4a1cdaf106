"""Messages to show, rigs to show them of, and a browser made of a websocket."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
import zstandard
from viser import _messages
from websockets.sync.client import ClientConnection, connect

from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable, ObjectTable, RigTable, Viewer
from rhot.hand import DIGITS, JOINTS, default_hand, forward, joint_radii_m
from rhot.messages import (
    FingerAngles,
    FingerPose,
    HandJoint,
    HandPoint,
    HandPoints,
    HandPose,
    WristPose,
)
from rhot.messages.health import Health, StreamHealth
from rhot.messages.objects import Contact, Grasp, ObjectContacts, ObjectPose

STAMP_NS = 1_700_000_000_000_000_000
IDENTITY = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture
def config() -> RigConfig:
    """A rig with two cameras, a right hand and a cup, which is calibrated nowhere."""
    return RigConfig(
        rig=RigTable(name="desk"),
        camera=[CameraTable(name="left"), CameraTable(name="right")],
        hand={"right": HandTable(markers={"wrist": "violet", "index_tip": "blue"})},
        object=[ObjectTable(name="cup", serial="LHR-1", shape="cylinder", size_m=(0.07, 0.1))],
        viewer=Viewer(port=0),
        folder="/nonexistent",
    )


@pytest.fixture
def make_pose() -> Callable[..., HandPose]:
    """A flat right hand at (0, 0, 0.5); joints' positions and any other field replaceable."""
    model = default_hand("right")
    positions, _ = forward(model, np.eye(3), np.array([0.0, 0.0, 0.5]), np.zeros((5, 4)))
    radii = joint_radii_m(model)

    def make(at: Any = None, source: str = "solved", **fields: Any) -> HandPose:
        where = positions if at is None else np.broadcast_to(at, (26, 3))
        joints = [
            HandJoint(
                name=name,
                position_m=tuple(p),
                orientation_wxyz=IDENTITY,
                radius_m=float(r),
                source=source,
            )  # type: ignore[arg-type]
            for name, p, r in zip(JOINTS, where.tolist(), radii, strict=True)
        ]
        angles = FingerAngles(abduction=0.0, mcp=0.5, pip=1.0, dip=0.66)
        fingers = [
            FingerPose(name=d, angles_rad=angles, residual_m=0.001, iterations=3, status="solved")
            for d in DIGITS
        ]  # type: ignore[arg-type]
        values: dict[str, Any] = {
            "hand": "right",
            "seq": 1,
            "stamp_ns": STAMP_NS,
            "method": "dls",
            "wrist": WristPose(position_m=(0.0, 0.0, 0.5), orientation_wxyz=IDENTITY),
            "joints": joints,
            "fingers": fingers,
        }
        return HandPose(**(values | fields))

    return make


@pytest.fixture
def make_points() -> Callable[..., HandPoints]:
    """Points of the right hand by name, all at one place."""

    def make(
        *names: str, at: tuple[float, float, float] = (0.0, 0.0, 0.5), source: Any = "measured"
    ) -> HandPoints:
        points = [
            HandPoint(
                name=name, position_m=at, sigma_m=(0.001,) * 3, cameras=["left"], source=source
            )
            for name in names
        ]  # type: ignore[arg-type]
        return HandPoints(hand="right", seq=1, stamp_ns=STAMP_NS, points=points)

    return make


@pytest.fixture
def make_object() -> Callable[..., ObjectPose]:
    def make(name: str = "cup", **fields: Any) -> ObjectPose:
        values: dict[str, Any] = {
            "object": name,
            "serial": "LHR-1",
            "seq": 1,
            "stamp_ns": STAMP_NS,
            "position_m": (0.1, 0.1, 0.5),
            "orientation_wxyz": IDENTITY,
            "velocity_m_s": (0.0, 0.0, 0.0),
            "angular_velocity_rad_s": (0.0, 0.0, 0.0),
            "tracking": "ok",
            "registered": True,
        }
        return ObjectPose(**(values | fields))

    return make


@pytest.fixture
def make_contacts() -> Callable[..., ObjectContacts]:
    """Contacts of the right hand: parts touch at a point, held parts hold, near ones do neither."""

    def make(
        *parts: str, held: Any = (), near: Any = (), name: str = "cup", at: Any = (0.1, 0.1, 0.5)
    ) -> ObjectContacts:
        contacts = [
            Contact(
                hand="right",
                part=part,  # type: ignore[arg-type]
                distance_m=0.0 if part in parts else 0.02,
                sigma_m=0.001,
                point_m=at,
                touching=part in parts,
                since_ns=STAMP_NS if part in parts else 0,
            )
            for part in (*parts, *near)
        ]
        grasps = [Grasp(hand="right", parts=list(held), since_ns=STAMP_NS)] if held else []
        return ObjectContacts(
            object=name, seq=1, stamp_ns=STAMP_NS, contacts=contacts, grasps=grasps
        )

    return make


@pytest.fixture
def make_health() -> Callable[..., Health]:
    def make(service: str = "fusion", **fields: Any) -> Health:
        stream: dict[str, Any] = {
            "key": "rhot/desk/hand/right/points",
            "direction": "out",
            "count": 30,
            "rate_hz": 29.9,
            "expected_hz": 30.0,
            "ok": True,
            "dropped": 0,
            "rejected": 0,
            "latency_p50_ms": 1.25,
            "latency_p99_ms": 3.0,
        }
        values: dict[str, Any] = {
            "service": service,
            "instance": "main",
            "stamp_ns": STAMP_NS,
            "version": "1",
            "pid": 1,
            "uptime_s": 1.0,
            "state": "running",
            "errors": 0,
            "last_error": "",
            "cpu_percent": 3.0,
            "rss_mb": 50.0,
        }
        streams = [StreamHealth(**(stream | fields.pop("stream", {})))]
        return Health(**(values | {"streams": streams} | fields))

    return make


class Browser:
    """What a browser does as far as viser's server can see: says hello, and is told messages."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._heard: list[dict[str, Any]] = []
        self._send(
            _messages.ViewerCameraMessage(
                IDENTITY,
                (0.0, 0.0, 0.0),
                1.0,
                0.1,
                10.0,
                100,
                100,
                (0.0, 0.0, 1.0),
                (0.0, -1.0, 0.0),
            )
        )

    def _send(self, message: _messages.Message) -> None:
        self._connection.send(msgspec.msgpack.encode(message.as_serializable_dict()))

    def click(self, uuid: str, value: bool | str) -> None:
        """Set a checkbox, or choose of a list."""
        self._send(_messages.GuiUpdateMessage(uuid, {"value": value}))

    def share(self) -> None:
        """Ask for the public tunnel that must not be."""
        self._send(_messages.ShareUrlRequest())

    def wait_for(self, type_: str, timeout_s: float = 60.0, **fields: Any) -> dict[str, Any]:
        """A message of a type with the given fields, among those since `forget` or to come.

        A callable value is asked.
        """
        at = 0
        while True:
            for message in self._heard[at:]:
                if message["type"] == type_ and all(
                    v(message.get(k)) if callable(v) else message.get(k) == v
                    for k, v in fields.items()
                ):
                    return message
            at = len(self._heard)
            self._heard += _decode(self._connection.recv(timeout=timeout_s))

    def heard_of(self, what: str, type_: str = "", **fields: Any) -> bool:
        """Whether any message until now, of that type if one is given, has these words in it."""
        return any(
            what in str(message)
            and (not type_ or message["type"] == type_)
            and all(message.get(key) == value for key, value in fields.items())
            for message in self._heard
        )

    def window(self, timeout_s: float = 60.0) -> list[dict[str, Any]]:
        """The messages that come together next, with their arrays: a browser draws them at once."""
        return _decode(self._connection.recv(timeout=timeout_s))

    def heard(self, type_: str) -> list[dict[str, Any]]:
        """The messages of a type heard since `forget`."""
        return [message for message in self._heard if message["type"] == type_]

    def forget(self) -> None:
        """Forget the messages heard so far."""
        self._heard.clear()

    def close(self) -> None:
        """Leave."""
        self._connection.close()


def _decode(frame: str | bytes) -> list[dict[str, Any]]:
    """Messages, and after them their arrays, each from a multiple of 8 bytes on."""
    assert isinstance(frame, bytes)
    end = 16 + int.from_bytes(frame[8:16], "little")
    inner = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(frame[16:end]))
    arrays: list[bytes] = []
    for size in inner["binaryBufferLengths"]:
        start = -(-end // 8) * 8
        end = start + size
        arrays.append(frame[start:end])
    return [_with_arrays(message, arrays) for message in inner["messages"]]


def _with_arrays(value: Any, arrays: list[bytes]) -> Any:
    if not isinstance(value, dict):
        return value
    if "__binary_index" in value:
        return np.frombuffer(arrays[value["__binary_index"]], value["dtype"])
    return {key: _with_arrays(one, arrays) for key, one in value.items()}


@pytest.fixture
def browse() -> Iterator[Callable[..., Browser]]:
    """Open a Browser at a port; closed at the end of the test."""
    connections: list[ClientConnection] = []

    def open_(port: int, target: str = "", **options: Any) -> Browser:
        connection = connect(
            f"ws://127.0.0.1:{port}{target}",
            subprotocols=[f"viser-v{viser.__version__}"],
            max_size=None,
            **options,
        )  # type: ignore[list-item]
        connections.append(connection)
        return Browser(connection)

    yield open_
    for connection in connections:
        connection.close()
