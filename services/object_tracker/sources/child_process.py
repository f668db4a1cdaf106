"""A program as a child process whose lines are read: bounded, whatever it prints, and stopped in
the end, even if it hangs.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
from asyncio.subprocess import DEVNULL, PIPE, Process
from collections import deque
from collections.abc import AsyncGenerator, Sequence

from rhot.errors import SourceError
from rhot.plain_text import clipped

# libsurvive prints up to 1 MB a second; the event loop has its turn after this much of it.
_CHUNK = 1 << 16
# A device's CONFIG line, libsurvive's longest, has some 20 kB; a longer one is damaged.
_LONGEST_LINE = 1 << 18
# How long it may be silent before its reader hears of it: shorter than what makes a device lost.
_LOOK_S = 0.1
# survive-cli ends within a fraction of a second of SIGTERM; one that hangs is killed.
_TERMINATE_S = 2.0
# What a program said last, kept for the error that tells of its end.
_LAST_WORDS = 3
_LONGEST_WORD = 200
# libsurvive prints names in colours.
_COLOR = re.compile(r"\x1b\[[0-9;]*m")


class ChildProcess:
    """A running program; last_words holds the last lines of its standard error, and what else was
    noted.
    """

    def __init__(self, process: Process) -> None:
        if process.stdout is None or process.stderr is None:
            raise ValueError("start the program with stdout=PIPE and stderr=PIPE")
        self._process = process
        self._stdout, self._stderr = process.stdout, process.stderr
        self.last_words: deque[str] = deque(maxlen=_LAST_WORDS)
        self.skipped = 0
        self._listener = asyncio.create_task(self._listen())

    def note(self, text: str) -> None:
        """Keep one of its lines as last words."""
        words = clipped(_COLOR.sub("", text).strip(), _LONGEST_WORD).strip()
        if words:
            self.last_words.append(words)

    async def lines(self, silent_s: float) -> AsyncGenerator[list[str]]:
        """Its lines as they come, some at a time, until it closes its output; an empty list where
        none came for a while.

        Lines longer than 256 kB are skipped and counted. Raises SourceError if nothing comes for
        silent_s seconds.
        """
        rest, skipping, silent = b"", False, 0.0
        while silent < silent_s:
            try:
                async with asyncio.timeout(_LOOK_S):
                    chunk = await self._stdout.read(_CHUNK)
            except TimeoutError:
                silent += _LOOK_S
                yield []
                continue
            silent = 0.0
            if not chunk:
                if rest:
                    yield [rest.decode("utf-8", "replace")]
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._process.wait(), _TERMINATE_S)
                return
            # A reader with bytes at hand does not wait: others would never have their turn.
            await asyncio.sleep(0)
            *whole, rest = (rest + chunk).split(b"\n")
            if whole and skipping:
                del whole[0]
                skipping = False
            if len(rest) > _LONGEST_LINE:
                self.skipped += not skipping
                rest, skipping = b"", True
            if whole:
                yield [line.decode("utf-8", "replace") for line in whole]
        raise SourceError(f"has printed nothing for {silent_s:g} s")

    async def stop(self) -> str:
        """End it if it still runs; how it ended, as words."""
        if self._process.returncode is None:
            self._signal(signal.SIGTERM)
            try:
                await asyncio.wait_for(self._drained(), _TERMINATE_S)
            except TimeoutError:
                self._signal(signal.SIGKILL)
                await self._process.wait()
        # What it started itself, too: a wrapper's survive-cli would keep the tracker's USB.
        self._signal(signal.SIGKILL)
        await self._listener
        if self.code >= 0:
            return f"ended with exit code {self.code}"
        return f"was ended by {signal.Signals(-self.code).name}"

    @property
    def code(self) -> int:
        """Its exit code, negative for a signal's number; 0 while it runs."""
        return self._process.returncode or 0

    def _signal(self, number: signal.Signals) -> None:
        """To the program and all that it started: they are a group of their own."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, number)

    async def _drained(self) -> None:
        """Its output is read to the end: a program that waits for its reader does not end."""
        while await self._stdout.read(_CHUNK):
            pass
        await self._process.wait()

    async def _listen(self) -> None:
        rest = b""
        while chunk := await self._stderr.read(_CHUNK):
            *whole, rest = (rest + chunk).split(b"\n")
            rest = rest[-_LONGEST_WORD:]
            for line in whole[-_LAST_WORDS:]:
                self.note(line.decode("utf-8", "replace"))
        self.note(rest.decode("utf-8", "replace"))


async def start(command: Sequence[str], advice: str) -> ChildProcess:
    """Start a program without an input. Raises SourceError, ending with the advice."""
    try:
        process = await asyncio.create_subprocess_exec(
            *command, stdin=DEVNULL, stdout=PIPE, stderr=PIPE, start_new_session=True
        )
    except OSError as error:
        raise SourceError(f"cannot start {command[0]}: {error.strerror}; {advice}") from None
    return ChildProcess(process)
