"""Child processes that are restarted when they end: what systemd does for an installed rig.

Each child leads a session of its own: Ctrl-C reaches only the supervisor, which ends the children.
The kernel kills them should the supervisor be killed. What they write comes out line by line with
its level.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from rhot.process import logs
from rhot.process.event_loop import end_process, ending_with_parent
from rhot.process.lifecycle import EXIT_AGAIN, EXIT_USER
from services.cli.rig.child_output import ChildOutput

# Poses are back within two seconds of a crash, and a rig that cannot start is readable.
_RESTART_S = 0.5
# A service that ended with a message for the user would end with the same one at once; a new try
# every five seconds is enough.
_RESTART_AFTER_USER_ERROR_S = 5.0
# A service ends within a second of SIGTERM; five are for a loaded machine.
_STOP_S = 5.0
_LINE_LIMIT = 1 << 20
# A child that lived longer than this had started well: what it says next is news again.
_SETTLED_S = 30.0


@dataclass(frozen=True)
class Child:
    """A process to keep running, called after the service in it; others may be in it too."""

    name: str
    argv: Sequence[str]
    others: tuple[str, ...] = ()


def service_argv(package: str, *options: str) -> list[str]:
    """Command line of one of our own services, in this very Python."""
    return [sys.executable, "-m", f"services.{package}", *options]


class Supervisor:
    """Runs children until cancelled; log(name, level, text) gets each line that they write, and
    why they ended. A child that fails in the same way again says so once.
    """

    def __init__(self, log: Callable[[str, str, str], None]) -> None:
        self.restarts: dict[str, int] = {}
        self.pids: dict[str, int] = {}
        # Why each child that has ended did so, the last time.
        self.reasons: dict[str, str] = {}
        self._log = log

    async def keep_running(self, child: Child) -> None:
        """Start one child again whenever it ends; ends it when cancelled."""
        before, told = None, ""
        while True:
            started_s = time.monotonic()
            output = ChildOutput(partial(self._log, child.name), before)
            code = await self._run_once(child, output)
            ran_s = time.monotonic() - started_s
            self.restarts[child.name] = self.restarts.get(child.name, 0) + 1
            if code == EXIT_AGAIN:
                self._log(child.name, "note", output.last_line)
                before, told = None, ""
                continue
            pause_s = _RESTART_AFTER_USER_ERROR_S if code == EXIT_USER else _RESTART_S
            self.reasons[child.name] = output.reason or f"ended with {_describe(code)}"
            same = f"{code} {output.reason}"
            if same != told or ran_s > _SETTLED_S:
                self._log(child.name, "warning", _end_text(code, ran_s, pause_s, output))
            before, told = output, same
            await asyncio.sleep(pause_s)

    async def _run_once(self, child: Child, output: ChildOutput) -> int:
        process = await asyncio.create_subprocess_exec(
            *child.argv,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            start_new_session=True,
            preexec_fn=ending_with_parent(),
            limit=_LINE_LIMIT,
            # The level of a line is to be read here, whatever the user likes to read.
            env={**os.environ, logs.FORMAT: "json"},
        )
        self.pids[child.name] = process.pid
        try:
            await _read_lines(process, output)
            return await process.wait()
        finally:
            await asyncio.shield(end_process(process, _STOP_S))


async def _read_lines(process: asyncio.subprocess.Process, output: ChildOutput) -> None:
    if process.stdout is None:
        return
    while True:
        try:
            line = await process.stdout.readline()
        except ValueError:  # a line beyond the limit: asyncio has dropped it
            continue
        if not line:
            return
        output.take(line.decode(errors="replace").rstrip())


def _end_text(code: int, ran_s: float, pause_s: float, output: ChildOutput) -> str:
    text = f"ended with {_describe(code)} after {ran_s:.1f} s, starting again in {pause_s:g} s"
    # An error has been told when it came; else the last lines are all there is to go by.
    if code == 0 or output.last_error or not output.reason:
        return text
    return f"{text}; its last lines:\n{output.reason}"


def _describe(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"code {code}"
