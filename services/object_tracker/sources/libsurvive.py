"""Poses from libsurvive: runs its `survive-cli --record-stdout` and parses the lines it prints.

If survive-cli is missing or ends, SourceError is raised. A device that libsurvive loses sends no
more poses. Its own log goes to our standard error, that is, to the journal. Cancelling ends the
subprocess.
"""

from __future__ import annotations

import asyncio
import contextlib
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncGenerator, Sequence

from rhot import clock
from rhot.errors import SourceError
from rhot.messages.objects import OpenVrPose
from services.object_tracker.survive_lines import RunClock, SurviveParser, openvr_pose

# A device's CONFIG line is some 6 kB; a line longer than this is damaged and is skipped.
_LONGEST_LINE = 1 << 20
# survive-cli ends within a fraction of a second of SIGTERM; one that hangs is killed.
_TERMINATE_S = 2.0


class LibSurvive:
    """survive-cli as a source; `command` starts it."""

    def __init__(self, command: Sequence[str] = ("survive-cli", "--record-stdout")) -> None:
        self._command = tuple(command)

    async def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Poses of every device libsurvive tracks; its run time is converted to wall-clock time."""
        process = await self._start()
        try:
            parser, run_clock, seq = SurviveParser(), RunClock(), 0
            while line := await _next_line(process):
                arrival_ns = clock.now_ns()
                pose = parser.feed(line.decode("utf-8", "replace"))
                if pose is not None:
                    yield openvr_pose(pose, seq, run_clock.stamp_ns(pose.time_s, arrival_ns))
                    seq += 1
            code = await process.wait()
        finally:
            await _stop(process)
        raise SourceError(
            f"{self._command[0]} ended with exit code {code}; see its messages above,"
            " check the tracker's USB and run `survive-cli` by itself"
        )

    async def _start(self) -> Process:
        try:
            return await asyncio.create_subprocess_exec(
                *self._command, stdout=PIPE, limit=_LONGEST_LINE
            )
        except OSError as error:
            raise SourceError(
                f"cannot start {self._command[0]}: {error.strerror}; install libsurvive so that"
                " `survive-cli` is on the PATH, or choose another [objects] source"
            ) from None


async def _next_line(process: Process) -> bytes:
    """The next line, empty at the end; over-long ones are skipped."""
    while True:
        try:
            return await process.stdout.readline() if process.stdout else b""
        except ValueError:
            continue


async def _stop(process: Process) -> None:
    if process.returncode is not None:
        return
    with contextlib.suppress(ProcessLookupError):
        process.terminate()
    try:
        # Its pipe is read to the end: one that nobody reads would stay open.
        await asyncio.wait_for(process.communicate(), _TERMINATE_S)
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
