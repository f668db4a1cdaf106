"""The client SDK without asyncio: every stream is a `for` loop, every question a call.

    with rhot.open("tcp/127.0.0.1:7447") as rig:
        for pose in rig.hand_poses("right"):
            print(pose.joint("index_tip").position_m)

For scripts, plots and programs that have a loop of their own. Ctrl-C ends the `with` block, without
a traceback; what stands after it still runs. Each rig has an event loop in a thread of its own, so
that slow work in a `for` loop delays nobody: streams skip to the newest message, or queue=n keeps
the last n.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import AbstractAsyncContextManager, AbstractContextManager
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, TypeVar

from rhot.client import CONNECT_S, DEFAULT_ENDPOINT, RigClient, connect
from rhot.contact_events import GraspEvent, TouchEvent
from rhot.hand import HandName
from rhot.messages import HandPoints, HandPose, MarkerFrame, Session
from rhot.messages.objects import ObjectContacts, ObjectPose

T = TypeVar("T")

# Python on Windows hears Ctrl-C between two looks only.
_LOOK_S = 0.25


def open(  # noqa: A001 - rhot.open(...), as a file is opened
    endpoint: str = DEFAULT_ENDPOINT,
    rig: str = "*",
    certificates: str | Path | None = None,
    timeout_s: float | None = CONNECT_S,
) -> AbstractContextManager[BlockingRig, bool]:
    """A session with the router at endpoint, for a `with` block; arguments as rhot.connect.

    Entering raises BusError if no router answers within timeout_s.
    """
    return _Opened(connect(endpoint, rig, certificates, timeout_s))


class _Opened(AbstractContextManager["BlockingRig", bool]):
    """The session and the event loop that it lives in."""

    def __init__(self, session: AbstractAsyncContextManager[RigClient]) -> None:
        self._session = session
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="rhot", daemon=True)

    def __enter__(self) -> BlockingRig:
        self._thread.start()
        try:
            return BlockingRig(self._loop, _result(self._loop, self._session.__aenter__()))
        except BaseException:
            self._end()
            raise

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> bool:
        try:
            _result(self._loop, self._session.__aexit__(None, None, None))
        finally:
            self._end()
        return kind is KeyboardInterrupt

    def _end(self) -> None:
        _result(self._loop, _cancel_tasks())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


class BlockingRig:
    """A rig seen from outside, for programs without asyncio; `client` is its RigClient."""

    def __init__(self, loop: asyncio.AbstractEventLoop, client: RigClient) -> None:
        self.client = client
        self._loop = loop

    def hand_poses(
        self, hand: HandName | None = None, queue: int | None = None
    ) -> Iterator[HandPose]:
        """Full hand poses, of one hand or of both."""
        return self._iterate(lambda: self.client.hand_poses(hand, queue))

    def latest_pose(self, hand: HandName | None = None, max_age_s: float = 0.5) -> HandPose | None:
        """The newest pose, at once if it came within max_age_s; else the next, waited for as long.

        None if there is none.
        """
        return self.ask(self.client.latest_pose(hand, max_age_s))

    def hand_points(
        self, hand: HandName | None = None, queue: int | None = None
    ) -> Iterator[HandPoints]:
        """3D landmarks, of one hand or of both."""
        return self._iterate(lambda: self.client.hand_points(hand, queue))

    def object_poses(
        self, name: str | None = None, queue: int | None = None
    ) -> Iterator[ObjectPose]:
        """Object poses, of one object or of all."""
        return self._iterate(lambda: self.client.object_poses(name, queue))

    def object_at(self, name: str, at_ns: int, timeout_s: float = 1.0) -> ObjectPose | None:
        """An object at an instant of the master's clock, that of a hand's pose for one."""
        return self.ask(self.client.object_at(name, at_ns, timeout_s))

    def contacts(
        self, name: str | None = None, queue: int | None = None
    ) -> Iterator[ObjectContacts]:
        """Distances of hands to objects that have a shape, who touches and holds them."""
        return self._iterate(lambda: self.client.contacts(name, queue))

    def grasps(self, name: str | None = None) -> Iterator[GraspEvent]:
        """Each begin and end of a grasp, of one object or of all."""
        return self._iterate(lambda: self.client.grasps(name))

    def touches(self, name: str | None = None) -> Iterator[TouchEvent]:
        """Each begin and end of a touch, finger by finger."""
        return self._iterate(lambda: self.client.touches(name))

    def markers(self, camera: str | None = None, queue: int | None = None) -> Iterator[MarkerFrame]:
        """Markers in the image of one camera or of all."""
        return self._iterate(lambda: self.client.markers(camera, queue))

    def session(self) -> Session | None:
        """The session's state, or None if no master answers."""
        return self.ask(self.client.session())

    def start(self) -> None:
        """Broadcast the start to all trackers (needs the rig's name in `open`)."""
        self._call(self.client.start)

    def stop(self) -> None:
        """Broadcast the stop to all trackers (needs the rig's name in `open`)."""
        self._call(self.client.stop)

    def ask(self, question: Coroutine[Any, Any, T]) -> T:
        """The result of any coroutine of `client`, e.g. rig.ask(rig.client.exposure("left"))."""
        return _result(self._loop, question)

    def _iterate(self, stream: Callable[[], AsyncIterator[T]]) -> Iterator[T]:
        # Subscribed at once, not at the first step of the loop, which may come much later.
        return _Stream(self._loop, self._call(stream))

    def _call(self, function: Callable[[], T]) -> T:
        async def called() -> T:
            return function()

        return _result(self._loop, called())


class _Stream(Iterator[T]):
    """A `for` loop over what an event loop in another thread receives."""

    def __init__(self, loop: asyncio.AbstractEventLoop, messages: AsyncIterator[T]) -> None:
        self._loop, self._messages = loop, messages

    def __next__(self) -> T:
        if self._loop.is_closed():
            raise StopIteration
        state, message = _result(self._loop, self._next())
        if state == "ended":
            raise StopIteration
        return message  # type: ignore[return-value]

    async def _next(self) -> tuple[Literal["message", "ended"], T | None]:
        # A future cannot carry StopAsyncIteration.
        try:
            return "message", await anext(self._messages)
        except StopAsyncIteration:
            return "ended", None


def _result(loop: asyncio.AbstractEventLoop, coroutine: Coroutine[Any, Any, T]) -> T:
    """The result of a coroutine in another thread's loop; Ctrl-C cancels it."""
    future = asyncio.run_coroutine_threadsafe(coroutine, loop)
    try:
        while True:
            done, _ = concurrent.futures.wait([future], _LOOK_S)
            if done:
                return future.result()
    except KeyboardInterrupt:
        future.cancel()
        raise


async def _cancel_tasks() -> None:
    """End what still waits in this loop."""
    own = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not own]
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
