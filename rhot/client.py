"""The client SDK: a rig's poses in a few lines.

    async with rhot.connect("tcp/127.0.0.1:7447") as rig:
        async for pose in rig.hand_poses("right"):
            print(pose.wrist.position_m)

Streams end with the `async with` block. Nothing arrives while nothing is sent; a router that dies
and returns is met again by itself. By default a stream skips to the newest message (`latest`); with
queue=n it delivers every message through a queue of n that drops the oldest. Without asyncio:
rhot.open (rhot/blocking.py).
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Coroutine
from pathlib import Path
from typing import Any, Generic, TypeVar, get_args

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.bus.bus_within import open_bus_within
from rhot.bus.liveliness import AliveWatch
from rhot.bus.security.credentials import with_certificates
from rhot.bus.subscription import Subscription
from rhot.contact_events import GraspEvent, GraspEvents, TouchEvent, TouchEvents
from rhot.errors import BusError
from rhot.hand import HandName
from rhot.messages import HandPoints, HandPose, MarkerFrame, Session
from rhot.messages.camera import Colors, ExposureControl
from rhot.messages.health import Health
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.object_motion import ObjectHistory
from rhot.topics import Topic

T = TypeVar("T")
Event = TypeVar("Event")

# Contacts waiting for who awaits events: 4 s of two hands at 30 Hz. Their state is whole, so that
# what is dropped loses no grasp.
_EVENT_QUEUE = 256
# How long `connect` looks for a router: one that starts at the same time is there in two seconds.
CONNECT_S = 10.0
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
_NO_ROUTER = (
    "`rhot demo` and `rhot up` start one (and print its endpoint), `rhot doctor` tells what is in "
    "the way. timeout_s=None waits for it"
)


class RigClient:
    """A rig seen from outside. `bus` is there for whatever has no method of its own."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self._followed: dict[str, _Followed] = {}
        self._newest: dict[str | None, _Newest[HandPose]] = {}

    def hand_poses(
        self, hand: HandName | None = None, queue: int | None = None
    ) -> Subscription[HandPose]:
        """Full hand poses, of one hand or of both."""
        return self._stream(topics.POSE, queue, hand=_known(hand))

    async def latest_pose(
        self, hand: HandName | None = None, max_age_s: float = 0.5
    ) -> HandPose | None:
        """The newest pose, at once if it came within max_age_s; else the next, waited for as long.

        None if there is none, so that a loop of its own rhythm (a game's, a robot's) never hangs.
        The first call begins to follow that hand.
        """
        newest = self._newest.get(hand)
        if newest is None:
            newest = self._newest[hand] = _Newest(self.hand_poses(hand))
        return await newest.within(max_age_s)

    def hand_points(
        self, hand: HandName | None = None, queue: int | None = None
    ) -> Subscription[HandPoints]:
        """3D landmarks, of one hand or of both."""
        return self._stream(topics.POINTS, queue, hand=_known(hand))

    def object_poses(
        self, name: str | None = None, queue: int | None = None
    ) -> Subscription[ObjectPose]:
        """Object poses, of one object or of all."""
        return self._stream(topics.OBJECT, queue, object=name)

    def contacts(
        self, name: str | None = None, queue: int | None = None
    ) -> Subscription[ObjectContacts]:
        """Distances of hands to one object or to all that have a shape, who touches and holds it.

        With several objects, queue=n: `latest` would skip one object's for another's.
        """
        return self._stream(topics.CONTACTS, queue, object=name)

    def grasps(self, name: str | None = None) -> AsyncIterator[GraspEvent]:
        """Each begin and end of a grasp, of one object or of all: `async for event in ...`.

        A grasp that is there already is the first event. stamp_ns is when it happened.
        """
        return _events(self.contacts(name, _EVENT_QUEUE), GraspEvents().feed)

    def touches(self, name: str | None = None) -> AsyncIterator[TouchEvent]:
        """Each begin and end of a touch, finger by finger, of one object or of all."""
        return _events(self.contacts(name, _EVENT_QUEUE), TouchEvents().feed)

    async def object_at(self, name: str, at_ns: int, timeout_s: float = 1.0) -> ObjectPose | None:
        """An object at an instant of the master's clock: that of a hand's pose, or some
        milliseconds ahead.

        Interpolated between its messages, carried on with its velocities for 0.1 s after the last
        one; None where it is not known, or lost. The first call for an object begins to follow it,
        and waits for its first message for timeout_s at most; half a second of it is kept.
        """
        followed = self._followed.get(name)
        if followed is None:
            followed = self._followed[name] = _Followed(self.object_poses(name, queue=256))
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(followed.heard.wait(), timeout_s)
        return followed.history.at(at_ns)

    def markers(
        self, camera: str | None = None, queue: int | None = None
    ) -> Subscription[MarkerFrame]:
        """Markers in the image of one camera or of all."""
        return self._stream(topics.MARKERS, queue, camera=camera)

    def health(self) -> Subscription[Health]:
        """Every service's health, once a second."""
        return self.bus.every(topics.HEALTH, 256)

    def services(self) -> AliveWatch:
        """Services as they come and go, beginning with those that are there."""
        return self.bus.watch_alive()

    async def session(self) -> Session | None:
        """The session's state, or None if no master answers."""
        answers = await self.bus.get(topics.SESSION)
        return answers[0] if answers else None

    def start(self) -> None:
        """Broadcast the start to all trackers (needs the rig's name in `connect`)."""
        self.bus.publisher(topics.SESSION).put(Session(running=True, start_ns=clock.now_ns()))

    def stop(self) -> None:
        """Broadcast the stop to all trackers (needs the rig's name in `connect`)."""
        self.bus.publisher(topics.SESSION).put(Session(running=False, start_ns=clock.now_ns()))

    async def colors(self, camera: str) -> Colors:
        """The colour ranges a camera's tracker uses; raises BusError if no such tracker answers."""
        return _one(await self.bus.get(topics.COLORS, camera=camera), camera)

    async def set_colors(self, camera: str, colors: Colors, timeout_s: float = 5.0) -> Colors:
        """Have a camera's tracker use these colour ranges, and keep them in its calibration file.

        Returns what it uses then. Raises RefusedError with the tracker's reason if it refuses them,
        BusError if none answers.
        """
        await self.colors(camera)
        return await self.bus.request(topics.COLORS, colors, timeout_s, camera=camera)

    async def exposure(self, camera: str) -> ExposureControl:
        """A camera's exposure now; raises BusError if no tracker of that camera answers."""
        return _one(await self.bus.get(topics.EXPOSURE, camera=camera), camera)

    async def set_exposure(
        self, camera: str, wanted: ExposureControl, timeout_s: float = 20.0
    ) -> ExposureControl:
        """Set exposure, gain and white balance, or run the camera's automatics once.

        Returns the values that hold then. Raises RefusedError with the tracker's reason if it
        refuses, or if the camera has no such controls; BusError if no tracker answers.
        """
        await self.exposure(camera)
        return await self.bus.request(topics.EXPOSURE, wanted, timeout_s, camera=camera)

    def _stream(self, topic: Topic[T], queue: int | None, **names: str | None) -> Subscription[T]:
        given = {field: name for field, name in names.items() if name is not None}
        return (
            self.bus.latest(topic, **given)
            if queue is None
            else self.bus.every(topic, queue, **given)
        )


async def _events(
    messages: Subscription[ObjectContacts], feed: Callable[[ObjectContacts], list[Event]]
) -> AsyncIterator[Event]:
    async for message in messages:
        for event in feed(message):
            yield event


class _Followed:
    """One object's last poses, kept up to date as long as its subscription lasts."""

    def __init__(self, poses: Subscription[ObjectPose]) -> None:
        self.history = ObjectHistory()
        self.heard = asyncio.Event()
        self._task = asyncio.create_task(self._follow(poses))

    async def _follow(self, poses: Subscription[ObjectPose]) -> None:
        async for pose in poses:
            self.history.add(pose)
            self.heard.set()


class _Newest(Generic[T]):
    """The newest message of a stream and when it came, kept up to date."""

    def __init__(self, messages: Subscription[T]) -> None:
        self._loop = asyncio.get_running_loop()
        self._message: T | None = None
        self._came_s = 0.0
        self._arrival = asyncio.Event()
        self._task = asyncio.create_task(self._follow(messages))

    async def within(self, seconds: float) -> T | None:
        """A message that came in the last seconds, or comes in the next; else None."""
        # Who asks in a loop without another await must let the messages in.
        await asyncio.sleep(0)
        if self._message is None or self._loop.time() - self._came_s > seconds:
            self._arrival.clear()
            try:
                await asyncio.wait_for(self._arrival.wait(), seconds)
            except TimeoutError:
                return None
        return self._message

    async def _follow(self, messages: Subscription[T]) -> None:
        async for message in messages:
            self._message, self._came_s = message, self._loop.time()
            self._arrival.set()


def _known(hand: HandName | None) -> HandName | None:
    """The hand as it is; raises ValueError if there is no such hand, whose poses never came."""
    if hand is not None and hand not in get_args(HandName):
        raise ValueError(f"there is no hand {hand!r}; give 'left', 'right', or None for both")
    return hand


def _one(answers: list[T], camera: str) -> T:
    if not answers:
        raise BusError(
            f"no tracker of camera {camera!r} answers; is it running, and is the name right? "
            "`rhot top` shows them"
        )
    return answers[0]


@contextlib.asynccontextmanager
async def connect(
    endpoint: str = DEFAULT_ENDPOINT,
    rig: str = "*",
    certificates: str | Path | None = None,
    timeout_s: float | None = CONNECT_S,
) -> AsyncIterator[RigClient]:
    """A session with the router at endpoint, looked for for timeout_s; None: as long as it takes.

    rig is the name in [rig] of rig.toml; "*" listens to every rig of that router. certificates is
    the folder of this host's ca.pem, own.pem and own.key, for an endpoint like
    tls/master.local:7448. Raises BusError if no router answers in time, or if certificates are the
    reason that there is no session.
    """
    folder = None if certificates is None else Path(certificates)
    endpoints = with_certificates([endpoint], folder, "connect")
    async with open_bus_within(timeout_s, rig, endpoints, _NO_ROUTER) as bus:
        yield RigClient(bus)


def run(program: Coroutine[Any, Any, T]) -> T | None:
    """asyncio.run() for a program that is ended by Ctrl-C: then it returns None, quietly."""
    try:
        return asyncio.run(program)
    except KeyboardInterrupt:
        return None
