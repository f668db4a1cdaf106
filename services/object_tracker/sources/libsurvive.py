"""Poses from libsurvive: runs its `survive-cli --record-stdout` and parses the lines it prints.

If survive-cli is missing, ends, or hangs, SourceError says so with its last words; who called tries
again. A device that libsurvive loses gets poses that are not valid: at once when it is unplugged,
a fifth of a second after its last light. Cancelling ends the child process.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import AsyncGenerator, Iterator, Sequence
from pathlib import Path

from rhot import clock
from rhot.errors import SourceError
from rhot.messages.objects import OpenVrPose
from services.object_tracker.sources.child_process import ChildProcess, start
from services.object_tracker.sources.survive_command import INSTALL, OUTPUT, survive_command
from services.object_tracker.survive_lines import (
    RunClock,
    SurviveParser,
    SurvivePose,
    openvr_pose,
    without_pose,
)

# A device prints its motion 1000 times a second, whether it sees light or not; without a device
# nothing comes. Starting again costs nothing then, and is what a survive-cli that hangs needs.
_SILENT_S = 30.0
# Poses come every 8 ms (vive/libsurvive), with gaps of up to 60 ms.
_LOST_AFTER_S = 0.2
# Without any line it is the machine that is busy, or the tracker that is off.
_SILENCE_S = 1.0
# A line of a device, with its time; options and logs have times before the clock runs.
_DEVICE_LINE = re.compile(r"(\d{1,9}\.\d{1,9}) (?!INFO |OPTION )\S+ ")
# libsurvive names a few devices at most.
_MOST_DEVICES = 64


class LibSurvive:
    """survive-cli as a source. `command` starts it (None: what is installed here); `arguments` are
    further ones of survive-cli.
    """

    def __init__(
        self,
        arguments: Sequence[str] = (),
        command: Sequence[str] | None = None,
        silent_s: float = _SILENT_S,
    ) -> None:
        self._arguments = tuple(arguments)
        self._command = command
        self._silent_s = silent_s

    async def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Poses of every device libsurvive tracks, stamped with this machine's clock.

        Ends only by SourceError.
        """
        command = survive_command() if self._command is None else tuple(self._command)
        child = await start([*command, *OUTPUT, *self._arguments], INSTALL)
        async with contextlib.aclosing(_poses(child, self._silent_s)) as poses:
            async for pose in poses:
                yield pose
        raise SourceError(f"survive-cli {_told('ended', child)}")


class Playback:
    """A recording of libsurvive's, solved again by survive-cli in real time."""

    def __init__(self, path: Path, arguments: Sequence[str] = ()) -> None:
        self._path = path
        self._arguments = ("--playback", str(path), "--playback-factor", "1", *arguments)

    async def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Poses as libsurvive computes them; ends with the recording.

        Raises SourceError if survive-cli fails, or computes none.
        """
        if not self._path.is_file():
            raise SourceError(f"there is no file {self._path}; correct [objects] source")
        child = await start([*survive_command(), *OUTPUT, *self._arguments], INSTALL)
        count = 0
        async with contextlib.aclosing(_poses(child, _SILENT_S)) as poses:
            async for pose in poses:
                count += pose.bPoseIsValid
                yield pose
        if count == 0:
            raise SourceError(
                f"libsurvive computed no pose from {self._path}: it needs light and motion (lines"
                " W or C, and i or I); if the file has POSE lines, play them with"
                f' source = "replay:{self._path.name}"'
            )


async def _poses(child: ChildProcess, silent_s: float) -> AsyncGenerator[OpenVrPose]:
    """What a run of libsurvive tells, until it ends with code 0; SourceError for any other end."""
    reader, end = _Reader(child), ""
    try:
        async with contextlib.aclosing(child.lines(silent_s)) as groups:
            async for lines in groups:
                for pose in reader.read(lines, clock.now_ns()):
                    yield pose
        for pose in reader.read([], clock.now_ns()):
            yield pose
    except SourceError as error:
        end = str(error)
    finally:
        how = await child.stop()
    if end or child.code != 0:
        raise SourceError(f"survive-cli {_told(end or how, child)}")


def _told(what: str, child: ChildProcess) -> str:
    words = "; ".join(child.last_words) or "nothing"
    return (
        f"{what}; it said: {words}. Check the tracker's USB and udev rules, and run `survive-cli`"
        " by itself"
    )


class _Reader:
    """Lines of one run of libsurvive, to poses; devices that fell silent, too."""

    def __init__(self, child: ChildProcess) -> None:
        self._child = child
        self._parser, self._run_clock, self._seq = SurviveParser(), RunClock(), 0
        # The newest pose of each device that has one, and when it came.
        self._tracked: dict[str, tuple[SurvivePose, int]] = {}

    def read(self, lines: Sequence[str], now_ns: int) -> Iterator[OpenVrPose]:
        """What lines that came together say."""
        time_s = _device_time(lines[-1]) if lines else 0.0
        if time_s > 0.0:
            # Before the first pose, too: then the clocks' offset is known when it comes.
            self._run_clock.stamp_ns(time_s, now_ns)
        for line in lines:
            pose = self._parser.feed(line)
            if " LOG " in line[:40]:
                self._child.note(line.partition(" LOG ")[2])
            if pose is None:
                continue
            if pose.tracking != "ok":
                self._tracked.pop(pose.device, None)
            elif pose.device in self._tracked or len(self._tracked) < _MOST_DEVICES:
                self._tracked[pose.device] = pose, now_ns
            yield self._message(pose, now_ns)
        if not lines and (waiting := self._parser.flush()) is not None:
            yield self._message(waiting, now_ns)
        yield from self._lost(time_s, now_ns)

    def _lost(self, time_s: float, now_ns: int) -> Iterator[OpenVrPose]:
        """The devices that others, or libsurvive itself, have left behind; once each."""
        for device, (pose, came_ns) in list(self._tracked.items()):
            silent_s = 1e-9 * (now_ns - came_ns)
            if time_s - pose.time_s > _LOST_AFTER_S or silent_s > _SILENCE_S:
                del self._tracked[device]
                at_s = max(time_s, pose.time_s + _LOST_AFTER_S)
                yield self._message(without_pose(pose, at_s, "lost"), now_ns)

    def _message(self, pose: SurvivePose, now_ns: int) -> OpenVrPose:
        stamp_ns = self._run_clock.stamp_ns(pose.time_s, now_ns)
        message = openvr_pose(pose, self._seq, stamp_ns, self._parser.universe)
        self._seq += 1
        return message


def _device_time(line: str) -> float:
    """libsurvive's run time at a line of a device, 0 at any other."""
    found = _DEVICE_LINE.match(line)
    return float(found[1]) if found else 0.0
