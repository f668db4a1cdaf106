"""Poses from libsurvive: its `survive-cli --record-stdout` as a subprocess, whose lines
survive_lines reads.

survive-cli missing or ended raises SourceError. A device that libsurvive loses falls silent. Its
own log goes to our standard error, that is, to the journal. Cancelling ends the subprocess.
"""

from __future__ import annotations

import asyncio
import contextlib
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncGenerator, Sequence

from rhot import clock
from rhot.errors import SourceError
from rhot.messages import OpenVrPose
from services.object_tracker.survive_lines import RunClock, SurviveLines, openvr_pose

# A device's CONFIG line is some 6 kB; longer than this is no line of survive-cli's, and is skipped.
_LONGEST_LINE = 1 << 20
# survive-cli leaves within a fraction of a second of SIGTERM; a wedged one is killed.
_TERMINATE_S = 2.0


class LibSurvive:
    """survive-cli as a source; command is for other ways to start it."""

    def __init__(self, command: Sequence[str] = ("survive-cli", "--record-stdout")) -> None:
        self._command = tuple(command)

    async def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Poses of every device libsurvive tracks, stamped by survive-cli's own clock brought to
        the wall clock.
        """
        process = await self._start()
        try:
            lines, clocks, seq = SurviveLines(), RunClock(), 0
            while line := await _line(process):
                arrival_ns = clock.now_ns()
                pose = lines.feed(line.decode("utf-8", "replace"))
                if pose is not None:
                    yield openvr_pose(pose, seq, clocks.stamp_ns(pose.time_s, arrival_ns))
                    seq += 1
            code = await process.wait()
        finally:
            await _end(process)
        raise SourceError(
            f"{self._command[0]} ended with exit code {code}; see its messages above, check the tracker's USB and `survive-cli` by itself"
        )

    async def _start(self) -> Process:
        try:
            return await asyncio.create_subprocess_exec(
                *self._command, stdout=PIPE, limit=_LONGEST_LINE
            )
        except OSError as error:
            raise SourceError(
                f"cannot start {self._command[0]}: {error.strerror}; install libsurvive so that `survive-cli` is on the PATH,"
                " or choose another [objects] source"
            ) from None


async def _line(process: Process) -> bytes:
    """The next line, empty at the end; over-long ones are skipped."""
    while True:
        try:
            return await process.stdout.readline() if process.stdout else b""
        except ValueError:
            continue


async def _end(process: Process) -> None:
    if process.returncode is not None:
        return
    with contextlib.suppress(ProcessLookupError):
        process.terminate()
    try:
        await asyncio.wait_for(process.wait(), _TERMINATE_S)
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
