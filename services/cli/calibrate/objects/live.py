"""Listens while somebody moves a painted tracker through the volume, and says what is missing.

It ends when there is enough. Cameras or trackers from which nothing comes at all are errors that
say so; Ctrl-C ends it, and nothing is written.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import uvloop

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.messages import MarkerFrame
from services.calibrator.objects.recorded import Recorded
from services.calibrator.objects.wanted import Painted
from services.cli.router_session import router_session
from services.cli.terminal import Terminal

_LOOK_S = 1.0
# Trackers send 30 pictures a second, SteamVR 90 poses: so long without any and none will come.
_SILENT_S = 5.0
# So many times the wanted seconds; who has not moved it by then has gone away.
_PATIENCE = 6.0
# SteamVR may send a second's worth at once.
_QUEUE = 512
# What is missing, by the paint and the path so far; empty when there is enough.
Missing = Callable[[Recorded, Painted, Mapping[str, Camera]], list[str]]


@dataclass(frozen=True)
class Session:
    """What is listened to, and for how long."""

    rig: str
    endpoints: list[str]
    cameras: Mapping[str, Camera]
    painted: list[Painted]
    seconds: float


def listen(session: Session, missing: Missing) -> Recorded:
    """What was recorded until there was enough.

    Raises BusError without a router, CalibrationError if nothing comes or the person has gone away
    or pressed Ctrl-C.
    """
    teller, recorded = Terminal(), Recorded()
    names = " and ".join(f"{one.name}'s tracker ({one.color} paint)" for one in session.painted)
    teller.line(
        f"Move {names} slowly through the whole volume for {session.seconds:.0f} s, and turn it "
        "all the while: to the left and right, up and down, nearer and farther; tilt it forwards, "
        "sideways, and round. Keep the dab of paint towards the cameras. Ctrl-C ends."
    )
    began_s = time.monotonic()
    try:
        uvloop.run(_Listening(session, missing, teller, recorded).run())
    except KeyboardInterrupt:
        passed_s = time.monotonic() - began_s
        raise CalibrationError(
            f"ended by Ctrl-C after {passed_s:.0f} s: nothing was written"
        ) from None
    finally:
        teller.end()
    return recorded


def enough_motion(recorded: Recorded, one: Painted, cameras: Mapping[str, Camera]) -> list[str]:
    """What a registration still lacks."""
    return recorded.still_missing(one, cameras)


def nothing_more(recorded: Recorded, one: Painted, cameras: Mapping[str, Camera]) -> list[str]:
    """What a check still lacks: any motion will do."""
    seen = recorded.sightings(cameras, [one])[one.serial]
    blind = [c.name for n, c in enumerate(seen.cameras) if not (seen.camera == n).any()]
    if len(seen.cameras) - len(blind) >= 2:
        return []
    return [f"camera {' and '.join(blind)} does not see the {one.color} paint: turn it there"]


class _Listening:
    """One session, from the first message to enough of them."""

    def __init__(
        self, session: Session, missing: Missing, teller: Terminal, recorded: Recorded
    ) -> None:
        self._session, self._missing = session, missing
        self._teller, self._recorded = teller, recorded
        self._told: list[str] | None = None
        self._frames, self._poses = 0, 0

    async def run(self) -> None:
        """Listen, look once a second, end."""
        async with router_session(self._session.rig, self._session.endpoints) as bus:
            listeners = [
                asyncio.ensure_future(one) for one in (self._hear_cameras(bus), self._hear_vr(bus))
            ]
            try:
                await self._look()
            finally:
                for listener in listeners:
                    listener.cancel()
                    with contextlib.suppress(asyncio.CancelledError):
                        await listener

    async def _hear_cameras(self, bus: Bus) -> None:
        async for frame in bus.every(topics.MARKERS, _QUEUE):
            self._recorded.add_frame(frame)

    async def _hear_vr(self, bus: Bus) -> None:
        async for pose in bus.every(topics.OPENVR, _QUEUE):
            self._recorded.add_pose(pose)

    async def _look(self) -> None:
        began_s = time.monotonic()
        wanted_s = self._session.seconds
        while True:
            await asyncio.sleep(_LOOK_S)
            passed_s = time.monotonic() - began_s
            if passed_s > _SILENT_S:
                self._check_silence()
            missing: list[str] = []
            for one in self._session.painted:
                found = await asyncio.to_thread(
                    self._missing, self._recorded, one, self._session.cameras
                )
                name = f"{one.name}: " if len(self._session.painted) > 1 else ""
                missing += [name + text for text in found]
            self._tell(passed_s, missing)
            if passed_s >= wanted_s and not missing:
                self._teller.line(f"enough after {passed_s:.0f} s: computing")
                return
            if passed_s > _PATIENCE * wanted_s:
                raise CalibrationError(
                    f"not enough after {passed_s:.0f} s, still missing: {'; '.join(missing)}. "
                    "Nothing was written"
                )

    def _check_silence(self) -> None:
        frames, poses = self._recorded.frames, self._recorded.poses
        silent = [name for name in self._session.cameras if not _has_camera(frames, name)]
        if len(silent) > len(self._session.cameras) - 2:
            raise CalibrationError(
                f"no markers of camera {' and '.join(silent)} for {_SILENT_S:.0f} s, not even "
                "empty ones: are the trackers running and the session started? `rhot top` shows it"
            )
        lost = [one for one in self._session.painted if one.serial not in poses]
        if lost:
            heard = ", ".join(sorted(poses)) or "none at all"
            raise CalibrationError(
                f"no poses of {lost[0].serial} ({lost[0].name}'s tracker) for {_SILENT_S:.0f} s; "
                f"heard: {heard}. Is it switched on, its serial right in rig.toml, and "
                "object_tracker (or the bridge) running?"
            )

    def _tell(self, passed_s: float, missing: list[str]) -> None:
        """The rates on the status line; what is missing on a line of its own when it changes."""
        frames = self._recorded.frames[self._frames :]
        poses = sum(map(len, self._recorded.poses.values()))
        parts = [f"{passed_s:3.0f} s"]
        for one in self._session.painted:
            seen = [
                f"{name} {sum(_shows(frame, name, one.color) for frame in frames)}"
                for name in self._session.cameras
            ]
            parts.append(f"{one.color} seen a second by {', '.join(seen)}")
        parts.append(f"{poses - self._poses} poses")
        self._frames, self._poses = len(self._recorded.frames), poses
        line = "; ".join(parts)
        texts = [text for text in missing if " s more " not in text] or missing
        # Seconds that count down are the status line's, not news.
        news = [text for text in missing if " s more " not in text]
        if news != self._told:
            self._told = news
            self._teller.line(line + ("" if not texts else f". {_sentence(texts[0])}"))
        self._teller.status(line + (f". {_sentence(missing[0])}" if missing else ". Enough"))


def _has_camera(frames: list[MarkerFrame], name: str) -> bool:
    return any(frame.camera == name for frame in frames)


def _shows(frame: MarkerFrame, camera: str, color: str) -> bool:
    return frame.camera == camera and any(marker.color == color for marker in frame.markers)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
