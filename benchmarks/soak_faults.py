"""The faults of a soak run: what happens to a rig in weeks, in minutes.

Some end a process, which begins a new life for its memory; the others leave every process alive.
"""

from __future__ import annotations

import asyncio
import os
import random
import signal
from collections.abc import Awaitable, Callable
from pathlib import Path

import zenoh

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.bus.zenoh_config import client_config
from rhot.messages import Session
from services.cli.live.supervisor import service_argv

Fault = Callable[[], Awaitable[None]]
# The kind whose memory takes longest to settle.
PICTURES = "100 pictures asked for"
# For what others keep for a process that does not read: 3 s at 30 pictures a second fill it.
_LONG_STOP_S = 3.0
# Until a command has started and shows something, on a busy machine.
_START_S = 30.0


class Faults:
    """Plants faults in the running rig of a rig.toml; pids by process name as the supervisor has
    them.
    """

    def __init__(
        self, bus: Bus, path: Path, endpoint: str, pids: dict[str, int], seed: int
    ) -> None:
        self._bus, self._endpoint, self._pids = bus, endpoint, pids
        self._watch = service_argv(
            *("cli", "watch", "camera/left/markers"),
            *("--config", str(path), "--connect", endpoint),
        )
        self._random = random.Random(seed)
        self._session = bus.publisher(topics.SESSION)

    def pick_lethal(self) -> tuple[str, Fault]:
        """The end of some process."""
        process = self._random.choice(sorted(self._pids))
        return f"kill -9 {process}", lambda: self._kill(process)

    def pick(self) -> tuple[str, Fault]:
        """A fault that leaves all processes alive, by its name."""
        return self._random.choice(self.every_kind())

    def every_kind(self) -> list[tuple[str, Fault]]:
        """One of each kind that leaves all processes alive."""
        process = self._random.choice(sorted(self._pids))
        seconds = round(self._random.uniform(0.5, 4.0), 1)
        return [
            (f"{process} stopped for {seconds} s", lambda: self._stop(process, seconds)),
            ("a program that watches is killed", self._visitor),
            ("session stopped for 2 s", self._session_off),
            ("2,000 messages of garbage", self._garbage),
            ("JSON nested 32,000 deep on every stream", self._nested),
            (PICTURES, self._pictures),
        ]

    def every_stop(self) -> list[tuple[str, Fault]]:
        """Each process stopped once, for long."""

        def stop(process: str) -> Fault:
            return lambda: self._stop(process, _LONG_STOP_S)

        return [
            (f"{process} stopped for {_LONG_STOP_S:g} s", stop(process))
            for process in sorted(self._pids)
        ]

    async def _kill(self, process: str) -> None:
        os.kill(self._pids[process], signal.SIGKILL)

    async def _stop(self, process: str, seconds: float) -> None:
        pid = self._pids[process]
        os.kill(pid, signal.SIGSTOP)
        try:
            await asyncio.sleep(seconds)
        finally:
            os.kill(pid, signal.SIGCONT)

    async def _visitor(self) -> None:
        """Come and gone without a farewell, as processes of the rig do while lives are short."""
        visitor = await asyncio.create_subprocess_exec(
            *self._watch, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL
        )
        try:
            async with asyncio.timeout(_START_S):
                await visitor.stdout.readline()
        finally:
            visitor.kill()
            await visitor.wait()

    async def _session_off(self) -> None:
        self._session.put(Session(running=False, start_ns=clock.now_ns()))
        await asyncio.sleep(2.0)
        self._session.put(Session(running=True, start_ns=clock.now_ns()))

    async def _garbage(self) -> None:
        keys = self._stream_keys()
        for number in range(2000):
            payload = self._random.randbytes(self._random.randrange(1, 2000))
            self._bus.put_raw(self._random.choice(keys), payload)
            if number % 50 == 0:
                await asyncio.sleep(0.01)

    async def _nested(self) -> None:
        for key in self._stream_keys():
            # Just below the size that is rejected unread.
            self._bus.put_raw(key, b"[" * 32_000 + b"]" * 32_000)
            await asyncio.sleep(0.01)

    async def _pictures(self) -> None:
        def ask() -> None:
            with zenoh.open(client_config([self._endpoint])) as session:
                key = topics.FRAME.key(self._bus.rig)
                handles = [session.get(key, timeout=10.0) for _ in range(100)]
                for handle in handles:
                    for _ in handle:
                        pass

        await asyncio.to_thread(ask)

    def _stream_keys(self) -> list[str]:
        names = {
            "camera": "left",
            "hand": "right",
            "serial": "LHR-SIM",
            "object": "cup",
            "service": "fusion",
            "instance": "main",
            "host": "desk",
        }
        return [
            topic.key(self._bus.rig, **{field: names[field] for field in topic.fields})
            for topic in topics.TOPICS
            if topic.message is not None and topic is not topics.SESSION
        ]
