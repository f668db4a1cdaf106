"""What `rhot doctor` has seen in a few seconds, before anything is concluded from it."""

from __future__ import annotations

import msgspec

from rhot.files.config import RigConfig
from rhot.messages.objects import ObjectTracking
from rhot.watch.rig_state import RigState


class Reach(msgspec.Struct, kw_only=True):
    """Whether a router answers at an endpoint of rig.toml; problem is "" if it does.

    router is its id, where several endpoints were compared.
    """

    endpoint: str
    problem: str = ""
    router: str = ""


class CameraSeen(msgspec.Struct, kw_only=True):
    """Pictures' markers that arrived of one camera, and in how many of them each colour was."""

    frames: int = 0
    clock_known: int = 0
    colors: dict[str, int] = msgspec.field(default_factory=dict)


class HandSeen(msgspec.Struct, kw_only=True):
    """Messages that arrived of one hand; measured: points messages with a measured point;

    implausible: poses with a joint that is not finite or further away than any room is wide.
    """

    points: int = 0
    measured: int = 0
    poses: int = 0
    implausible: int = 0


class ObjectSeen(msgspec.Struct, kw_only=True):
    """Poses that arrived of one object, how many were ok in the rig's frame, and how the last was.

    contacts: messages of who touches it; touching: what the last of them said, in words.
    """

    poses: int = 0
    ok: int = 0
    state: ObjectTracking = "lost"
    contacts: int = 0
    touching: str = ""


class Observations(msgspec.Struct, kw_only=True):
    """Everything, in the order of the way from the file to the pose.

    A field that was not looked at, since an earlier one stood in the way, has its default.
    """

    config_path: str
    config: RigConfig | None = None
    config_problem: str = ""
    # Of tls endpoints: what is wrong with this host's certificate or the router's.
    certificate_problem: str = ""
    secured: bool = False
    reached: list[Reach] = msgspec.field(default_factory=list)
    # Endpoints at which routers on this computer listen, where rig.toml's does not answer.
    routers_here: list[str] = msgspec.field(default_factory=list)
    listened_s: float = 0.0
    state: RigState | None = None
    # By `service/instance`: where each of several of that name runs.
    doubles: dict[str, list[str]] = msgspec.field(default_factory=dict)
    session_running: bool | None = None
    # Who answers for the master's clock.
    clock_masters: list[str] = msgspec.field(default_factory=list)
    # Why fusion or solver cannot start, as far as files on this computer tell.
    calibration_problem: str = ""
    cameras: dict[str, CameraSeen] = msgspec.field(default_factory=dict)
    hands: dict[str, HandSeen] = msgspec.field(default_factory=dict)
    objects: dict[str, ObjectSeen] = msgspec.field(default_factory=dict)

    @property
    def connected(self) -> bool:
        """Whether a router answered."""
        return self.state is not None
