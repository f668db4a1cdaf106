"""Plays one recording: every payload on its key again, at the recorded times, under control.

It runs in a thread of its own, which sleeps to the microsecond where an event loop sleeps to the
millisecond, and reads ahead while nothing is due. Controls may be called from any thread. Keys are
rewritten to another rig's name; payloads and their stamps stay as they were, so that subscribers
compute the same again. Messages on keys that are not in the topics table, or cannot be published
on, are skipped. Files that are not complete recordings raise CaptureError.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rhot import topics
from rhot.errors import BusError, CaptureError
from services.recorder.pace import Pace, check_rate
from services.recorder.reader import Record, Summary, read, summarize

# publish(key, payload, encoding), called in the player's thread.
Publish = Callable[[str, bytes, str], None]
State = Literal["playing", "paused", "ended"]

# Messages read ahead while there is time: some seconds of a rig, some 100 kB.
_AHEAD = 512
# Reading on may take so long (a chunk is unpacked in 1 ms): nothing must be due meanwhile.
_READ_NS = 3_000_000
# Who jumps while it is paused sees what is there: the messages of so long.
_PEEK_NS = 100_000_000
# Until somebody does something.
_FOREVER_S = 3600.0


@dataclass(frozen=True)
class Route:
    """Where messages of one recorded key go."""

    key: str
    encoding: str


class Playback:
    """One recording being played; window_ns is what of it, both ends included.

    sent counts messages, position_ns is the recorded time of the newest one.
    """

    def __init__(
        self,
        path: Path,
        rig: str,
        publish: Publish,
        *,
        rate: float = 1.0,
        loop: bool = False,
        only: Collection[str] = (),
        window_ns: tuple[int, int] | None = None,
        stay: bool = False,
        report: Callable[[Record], None] | None = None,
    ) -> None:
        check_names(only)
        self.path = path
        self.summary: Summary = summarize(path)
        self.window_ns = window_ns or (self.summary.start_ns, self.summary.end_ns)
        self.loop = loop
        self.sent = 0
        self.position_ns = self.window_ns[0]
        self.state: State = "playing"
        self._rig, self._publish, self._only = rig, publish, only
        self._stay, self._report = stay, report
        self._pace = Pace(rate)
        self._routes: dict[str, Route | None] = {}
        # What is read and not sent yet, and what is to be read; None: nothing more.
        self._ahead: deque[tuple[Record, Route]] = deque()
        self._records: Iterator[tuple[Record, Route]] | None = None
        self._changed = threading.Condition()
        self._jump_ns: int | None = self.window_ns[0]
        # Up to here messages are sent although it is paused.
        self._peek_ns = -1
        self._stopping = False

    @property
    def rate(self) -> float:
        """1 is real time, 0 as fast as possible."""
        return self._pace.rate

    def set_rate(self, rate: float) -> None:
        """Go on at another rate; raises CaptureError."""
        check_rate(rate)
        with self._changed:
            self._pace.rate = rate
            self._pace.begin()
            self._changed.notify_all()

    def pause(self) -> None:
        """Send nothing until play()."""
        with self._changed:
            if self.state == "playing":
                self.state = "paused"
            self._changed.notify_all()

    def play(self) -> None:
        """Go on; from the beginning where the end was reached."""
        with self._changed:
            if self.state == "ended":
                self._jump_ns = self.window_ns[0]
            if self.state != "playing":
                self._pace.begin()
            self.state = "playing"
            self._changed.notify_all()

    def seek(self, at_ns: int) -> None:
        """Go on at a recorded time; one outside the window is brought to its nearer end."""
        with self._changed:
            self._jump_ns = min(max(at_ns, self.window_ns[0]), self.window_ns[1])
            self.position_ns = self._jump_ns
            if self.state == "ended":
                self.state = "paused"
            self._peek_ns = self._jump_ns + _PEEK_NS
            self._changed.notify_all()

    def stop(self) -> None:
        """End it, and run() with it."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()

    async def run(self) -> int:
        """Play to the end (with loop or stay until stop()); how many messages were sent."""
        playing = asyncio.create_task(asyncio.to_thread(self._run))
        try:
            return await asyncio.shield(playing)
        finally:
            self.stop()
            # Its thread must not outlive the session that it publishes on.
            await asyncio.shield(asyncio.wait([playing]))

    def _run(self) -> int:
        sent_before, began_ns = 0, 0
        while not self._stopping:
            jump_ns = self._take_jump()
            if jump_ns is not None:
                self._records, sent_before, began_ns = self._from(jump_ns), self.sent, jump_ns
            if self._ahead or self._read():
                self._send_when_due()
                continue
            if self.loop and self.sent == sent_before and began_ns == self.window_ns[0]:
                raise CaptureError(f"{self.path}: has nothing to replay in a loop")
            if self._at_end():
                break
        return self.sent

    def _take_jump(self) -> int | None:
        with self._changed:
            jump_ns, self._jump_ns = self._jump_ns, None
            if jump_ns is not None:
                self._ahead.clear()
                self._pace.begin()
        return jump_ns

    def _from(self, start_ns: int) -> Iterator[tuple[Record, Route]]:
        for record in read(self.path, start_ns, self.window_ns[1]):
            if record.key not in self._routes:
                self._routes[record.key] = _route(record.key, self._rig, self._only)
            route = self._routes[record.key]
            if route is not None:
                yield record, route

    def _read(self) -> bool:
        """Read one message on; false if there is none."""
        found = None if self._records is None else next(self._records, None)
        if found is None:
            self._records = None
            return False
        self._ahead.append(found)
        return True

    def _at_end(self) -> bool:
        """Nothing is left: begin anew, or wait for who jumps back; true if the playing is over."""
        with self._changed:
            if self._jump_ns is not None:
                return False
            if self.loop:
                self._jump_ns = self.window_ns[0]
                return False
            self.state, self.position_ns = "ended", self.window_ns[1]
            while self._stay and not self._stopping and self._jump_ns is None:
                self._changed.wait(_FOREVER_S)
            return not self._stay

    def _send_when_due(self) -> None:
        """Send the next message if it is due; else use the time until then, or until a change."""
        record, route = self._ahead[0]
        with self._changed:
            if self._jump_ns is not None or self._stopping:
                return
            paused = self.state == "paused"
            if paused and record.log_time_ns > self._peek_ns:
                self._changed.wait(_FOREVER_S)
                return
            now_ns = time.monotonic_ns()
            wait_ns = 0 if paused else self._pace.due_ns(record.log_time_ns, now_ns) - now_ns
            if wait_ns > 0 and not self._may_read(wait_ns):
                self._changed.wait(wait_ns * 1e-9)
                return
            if wait_ns <= 0:
                self._ahead.popleft()
                self.position_ns = self.position_ns if paused else record.log_time_ns
        if wait_ns > 0:
            self._read()
            # Others want the interpreter, too: without this they would wait up to 5 ms for it.
            time.sleep(0)
            return
        self._publish(route.key, record.payload, route.encoding)
        self.sent += 1
        if self._report is not None:
            self._report(record)

    def _may_read(self, wait_ns: int) -> bool:
        return wait_ns > _READ_NS and len(self._ahead) < _AHEAD and self._records is not None


def check_names(only: Collection[str]) -> None:
    """Raises CaptureError for names that are not those of recorded topics."""
    valid = sorted(topic.name for topic in topics.TOPICS if topic.recorded)
    unknown = sorted(set(only) - set(valid))
    if unknown:
        raise CaptureError(f"no recorded topic is called {unknown[0]!r}; valid: {', '.join(valid)}")


def _route(recorded_key: str, rig: str, only: Collection[str]) -> Route | None:
    topic = topics.find(recorded_key)
    if topic is None or not topic.recorded or (only and topic.name not in only):
        return None
    try:
        return Route(topic.key(rig, **(topic.names(recorded_key) or {})), topic.encoding)
    except BusError:
        # A key that is not valid, e.g. with a wildcard: it was recorded as it came, but cannot be
        # published again.
        return None
