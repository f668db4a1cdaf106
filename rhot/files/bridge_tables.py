"""The [bridges.*] tables of rig.toml: which other programs get hands and objects, and how.

Every key with its type, bounds, default and reason, as in rig_tables.py.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from rhot.files.rig_tables import Table

Port = Annotated[int, msgspec.Meta(ge=1, le=65535)]
# Of a server, 0 is any free one.
ServerPort = Annotated[int, msgspec.Meta(ge=0, le=65535)]
Metres = Annotated[float, msgspec.Meta(ge=-100.0, le=100.0)]


class Bridge(Table, frozen=True, kw_only=True):
    """What every bridge has."""

    # Whether `rhot up` and systemd run it.
    enabled: bool = False
    # Frames a second at most; what comes oftener is skipped, the newest goes out.
    rate_hz: Annotated[float, msgspec.Meta(gt=0.0, le=240.0)] = 60.0
    # This machine by default; there is no password.
    host: str = "127.0.0.1"


class PlacedBridge(Bridge, frozen=True, kw_only=True):
    """A bridge to a program with a floor: where the rig stands on it."""

    # The rig frame's axis that points up. Without [rig.world] the rig frame is the first camera's,
    # whose y points down.
    up: Literal["x", "-x", "y", "-y", "z", "-z"] = "-y"
    # Where the rig's origin is in the other program's space: x right, y up, z backward, in metres.
    # Cameras on a table, in front of who sits there.
    position_m: tuple[Metres, Metres, Metres] = (0.0, 0.8, -0.9)
    # The rig's turn about the vertical, counter-clockwise as seen from above: 180 are cameras that
    # look at the person, 0 cameras that look the same way.
    yaw_deg: Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)] = 180.0


class Vmc(PlacedBridge, frozen=True, kw_only=True):
    """Virtual Motion Capture protocol, OSC over UDP: VSeeFace, Warudo, Unity, Blender."""

    # Where the program listens; 39539 is the protocol's own.
    port: Port = 39539
    # Send the bones LeftHand and RightHand too, as they turn against an arm in T-pose. Without it
    # the program's own arms stay as they are.
    hand_bones: bool = False
    # Send wrists and objects as virtual trackers: left_wrist, right_wrist and the objects' names.
    trackers: bool = True


class OpenGloves(Bridge, frozen=True, kw_only=True):
    """OpenGloves, SteamVR's driver for gloves: its named pipe, or a serial line."""

    # Where the helper on the Windows computer listens (UDP), which writes OpenGloves' named pipe.
    port: Port = 4243
    # A serial device each, e.g. "/dev/rfcomm0", to send as a LucidGloves glove does; empty: none.
    serial_left: str = ""
    serial_right: str = ""
    # Of serial devices, as OpenGloves is set to.
    baud: Literal[9600, 19200, 38400, 57600, 115200, 230400] = 115200


class Monado(PlacedBridge, frozen=True, kw_only=True):
    """Monado's remote driver: hands in any OpenXR program."""

    # Where Monado listens; 4242 is its own.
    port: Port = 4242
    # Where the head is, as the remote driver wants one: x right, y up, z backward, in metres.
    head_m: tuple[Metres, Metres, Metres] = (0.0, 1.2, 0.0)


class Ros2(Bridge, frozen=True, kw_only=True):
    """ROS 2 through rmw_zenoh."""

    # Where ROS 2's Zenoh router (rmw_zenohd) listens; empty: the rig's own.
    connect: tuple[str, ...] = ()
    # ROS_DOMAIN_ID of the other side.
    domain: Annotated[int, msgspec.Meta(ge=0, le=232)] = 0
    # Humble has no hashes of types in its keys; all later distributions are as Jazzy.
    distribution: Literal["humble", "jazzy"] = "jazzy"


class Foxglove(Bridge, frozen=True, kw_only=True):
    """Foxglove, live: a WebSocket server that the program connects to."""

    # 8765 is Foxglove's own.
    port: ServerPort = 8765


class WebSocket(Bridge, frozen=True, kw_only=True):
    """JSON over WebSocket, for browsers and every language."""

    port: ServerPort = 8766
    # What programs of other machines must show, 16 letters or more; none can connect without.
    token: str = ""
    # Web pages that may connect, e.g. "http://localhost:3000"; programs always may.
    origins: tuple[str, ...] = ()


class WebXr(PlacedBridge, frozen=True, kw_only=True):
    """A page with hands and objects in a browser's WebXR scene."""

    port: ServerPort = 8767
    # What browsers of other machines must show, 16 letters or more: http://HOST:PORT/xr?token=...
    token: str = ""
    # Certificate and key (PEM), relative to rig.toml: headsets show no scene without https.
    certificate: str = ""
    key: str = ""


class Bridges(Table, frozen=True, kw_only=True):
    """All bridges: each is a process of its own, rhot-bridge --instance NAME."""

    vmc: Vmc = Vmc()
    opengloves: OpenGloves = OpenGloves()
    monado: Monado = Monado()
    ros2: Ros2 = Ros2()
    foxglove: Foxglove = Foxglove()
    websocket: WebSocket = WebSocket()
    webxr: WebXr = WebXr()

    @property
    def enabled(self) -> list[str]:
        """Names of the bridges that run."""
        return [name for name in self.__struct_fields__ if getattr(self, name).enabled]
