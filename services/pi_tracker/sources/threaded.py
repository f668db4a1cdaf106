"""A blocking reader as an asynchronous source, by a thread of its own.

Of a live camera the latest frame counts: what is overtaken is dropped and counted. Of a file all
frames count: the thread waits for its consumer. A reader that fails raises in the stream; one that
ends, ends it; a late one is waited for.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import AsyncGenerator, Callable

from rhot import clock
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.controls import Controls
from services.pi_tracker.sources.reader import Reader

# Frames of a file read ahead: enough to hide one slow decode.
_READ_AHEAD = 4
# How long a thread waits for a free place before it looks whether it should stop.
_STOP_CHECK_S = 0.2
# How long a reader may take to notice that it is closed; a camera's read gives up after 2 s.
_JOIN_S = 3.0


class ThreadedSource:
    """A reader in a thread of its own.

    real_time: a file's frames come no sooner than its stamps say, as a camera's would.
    """

    def __init__(self, reader: Reader, *, real_time: bool = False) -> None:
        self.live = reader.live
        self.notes = reader.notes
        self.controls: Controls | None = getattr(reader, "controls", None)
        self.dropped = 0
        self.rejected = 0
        self._reader = reader
        self._real_time = real_time and not reader.live
        self._stop = threading.Event()
        self._free_places = threading.Semaphore(_READ_AHEAD)
        self._frames: deque[Frame] = deque()
        self._lock = threading.Lock()
        self._error: BaseException | None = None
        self._ended = False

    def now_ns(self) -> int:
        return clock.now_ns()

    async def frames(self) -> AsyncGenerator[Frame, None]:
        changed = asyncio.Event()
        loop = asyncio.get_running_loop()

        def wake() -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(changed.set)

        thread = threading.Thread(target=self._run, args=(wake,), name="frame source", daemon=True)
        thread.start()
        try:
            while True:
                await changed.wait()
                changed.clear()
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
            self._free_places.release()
        return frame

    def _run(self, wake: Callable[[], None]) -> None:
        """The thread: open, read until the end or stop, close."""
        try:
            self._reader.open()
            try:
                self._read_all(wake)
            finally:
                self._reader.close()
        except BaseException as error:  # whatever it is, it belongs to the consumer
            self._error = error
        self._ended = True
        wake()

    def _read_all(self, wake: Callable[[], None]) -> None:
        origin_ns = 0
        while not self._stop.is_set():
            if not self.live and not self._free_places.acquire(timeout=_STOP_CHECK_S):
                continue
            frame = self._reader.read()
            if frame is None:
                return
            if self._real_time:
                origin_ns = origin_ns or clock.now_ns() - frame.stamp_ns
                self._stop.wait(max(0.0, (origin_ns + frame.stamp_ns - clock.now_ns()) * 1e-9))
            with self._lock:
                if self.live and self._frames:
                    self._frames.clear()
                    self.dropped += 1
                self._frames.append(frame)
            wake()
