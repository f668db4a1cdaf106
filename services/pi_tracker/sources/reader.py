"""The frame-source interface: blocking readers, and the thread that makes an asynchronous stream of
one.

A live camera's frames count only while they are new: the latest wins and what is skipped is
counted. A file's frames all count: the thread waits for its consumer. A reader that fails raises in
the stream; one that ends, ends it; a late one is waited for.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import AsyncGenerator, Callable
from typing import Protocol

from rhot import clock
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.controls import Controls

# Frames of a file read ahead: enough to hide one slow decode.
_AHEAD = 4
# How long a reader may take to notice that it is closed; a camera's read gives up after 2 s.
_JOIN_S = 3.0


class Reader(Protocol):
    """A source of frames that blocks. read() returns None at the end of a file.

    A camera never ends, it fails with SourceError.
    """

    live: bool
    # What the source could not do as asked, for the journal.
    notes: list[str]

    def open(self) -> None: ...

    def read(self) -> Frame | None: ...

    def close(self) -> None: ...


class Source(Protocol):
    """A source of frames for a service."""

    live: bool
    notes: list[str]
    # Exposure, of sources that have it.
    controls: Controls | None
    # Frames that came and were not delivered: overtaken by newer ones, or malformed.
    dropped: int
    rejected: int

    def now_ns(self) -> int:
        """The clock of the stamps."""

    def frames(self) -> AsyncGenerator[Frame, None]:
        """Every frame, or the latest one each time.

        Opens the source, and closes it when the iteration ends.
        """


class Threaded:
    """A reader in a thread of its own.

    paced: a file's frames come no sooner than its stamps say, as a camera's would.
    """

    def __init__(self, reader: Reader, *, paced: bool = False) -> None:
        self.live = reader.live
        self.notes = reader.notes
        self.controls: Controls | None = getattr(reader, "controls", None)
        self.dropped = 0
        self.rejected = 0
        self._reader = reader
        self._paced = paced and not reader.live
        self._stop = threading.Event()
        self._room = threading.Semaphore(_AHEAD)
        self._frames: deque[Frame] = deque()
        self._lock = threading.Lock()
        self._error: BaseException | None = None
        self._ended = False

    def now_ns(self) -> int:
        return clock.now_ns()

    async def frames(self) -> AsyncGenerator[Frame, None]:
        news = asyncio.Event()
        loop = asyncio.get_running_loop()

        def tell() -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(news.set)

        thread = threading.Thread(target=self._run, args=(tell,), name="frame source", daemon=True)
        thread.start()
        try:
            while True:
                await news.wait()
                news.clear()
                while (frame := self._take()) is not None:
                    yield frame
                if self._ended and not self._frames:
                    break
            if self._error is not None:
                raise self._error
        finally:
            self._stop.set()
            await asyncio.to_thread(thread.join, _JOIN_S)

    def _take(self) -> Frame | None:
        with self._lock:
            frame = self._frames.popleft() if self._frames else None
        if frame is not None and not self.live:
            self._room.release()
        return frame

    def _run(self, tell: Callable[[], None]) -> None:
        try:
            self._reader.open()
            try:
                self._pump(tell)
            finally:
                self._reader.close()
        except BaseException as error:  # whatever it is, it belongs to the consumer
            self._error = error
        self._ended = True
        tell()

    def _pump(self, tell: Callable[[], None]) -> None:
        origin_ns = 0
        while not self._stop.is_set():
            if not self.live and not self._room.acquire(timeout=0.2):
                continue
            frame = self._reader.read()
            if frame is None:
                return
            if self._paced:
                origin_ns = origin_ns or clock.now_ns() - frame.stamp_ns
                self._stop.wait(max(0.0, (origin_ns + frame.stamp_ns - clock.now_ns()) * 1e-9))
            with self._lock:
                if self.live and self._frames:
                    self._frames.clear()
                    self.dropped += 1
                self._frames.append(frame)
            tell()
