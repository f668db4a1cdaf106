"""What an onlooker knows of a rig at one instant: its services, its faults, its cameras, its
objects, its ages.

`rhot top`, `rhot doctor`, the page and the metrics show the same RigState. Pure.
"""

from __future__ import annotations

from typing import Literal

import msgspec

from rhot.messages.health import Fault, Health

# absent: expected and never heard; gone: its token is; silent: alive, but without a beat.
MISSING = ("absent", "gone", "silent")


class ServiceRow(msgspec.Struct, frozen=True, kw_only=True):
    """One service: its state (its own word, or one of MISSING), and its last health unless it is
    gone.

    heard_ns is when its last beat or token came, 0 if none has.
    """

    service: str
    instance: str
    state: str
    health: Health | None
    expected: bool = False
    heard_ns: int = 0

    @property
    def name(self) -> str:
        """`pi_tracker/left`; the service alone where there is one of it."""
        return self.service if self.instance == "main" else f"{self.service}/{self.instance}"


class StandingFault(msgspec.Struct, frozen=True, kw_only=True):
    """A fault and who tells of it: a service's name, or "" for what the onlooker finds itself."""

    teller: str
    fault: Fault


class CameraRow(msgspec.Struct, frozen=True, kw_only=True):
    """A camera's stream: the hands' markers seen in its newest picture, of how many; -1 while
    unknown.
    """

    camera: str
    markers: int
    expected_markers: int
    rate_hz: float
    expected_hz: float


class Ages(msgspec.Struct, frozen=True, kw_only=True):
    """Where the time of a hand's pose goes, medians in ms.

    Each stage's part, network included, in the order of the way; they add up to pose_ms, the age of
    a pose since mid-exposure when it is published. pose_p99_ms is that of the worst in a hundred.
    """

    hand: str
    tracker_ms: float
    fusion_ms: float
    solver_ms: float
    pose_ms: float
    pose_p99_ms: float


class ObjectRow(msgspec.Struct, frozen=True, kw_only=True):
    """An object; state is an ObjectTracking, `absent` if it never came, `silent` if no longer.

    age_ms is from its stamp to its arrival, sigma_m as in ObjectPose; touching and held_by have the
    parts of each hand. heard_ns is when its newest pose came, 0 if none has.
    """

    object: str
    state: str
    registered: bool = False
    heard_ns: int = 0
    age_ms: float = 0.0
    sigma_m: float | None = None
    touching: dict[str, list[str]] = msgspec.field(default_factory=dict)
    held_by: dict[str, list[str]] = msgspec.field(default_factory=dict)


class RigState(msgspec.Struct, frozen=True, kw_only=True):
    """Everything; faults with errors first, then the oldest.

    glass_to_pose_ms: latency (p50, p99) from mid-exposure to pose, by hand.
    """

    rig: str
    stamp_ns: int
    connection: Literal["ok", "lost"] = "ok"
    services: list[ServiceRow]
    faults: list[StandingFault]
    cameras: list[CameraRow]
    ages: list[Ages]
    glass_to_pose_ms: dict[str, tuple[float, float]]
    # Empty where the onlooker does not listen to objects.
    objects: list[ObjectRow] = msgspec.field(default_factory=list)

    @property
    def healthy(self) -> bool:
        """Every service runs, every stream is at its rate, and no error stands."""
        running = all(
            row.state == "running" and row.health and all(s.ok for s in row.health.streams)
            for row in self.services
        )
        return running and not self.errors

    @property
    def errors(self) -> int:
        """How many of the faults are errors."""
        return sum(one.fault.severity == "error" for one in self.faults)
