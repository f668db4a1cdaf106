"""What a registration is made of: marker frames of all cameras, poses of all trackers."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rhot import topics
from rhot.errors import CaptureError
from rhot.files.capture import read_lines
from rhot.geometry.camera import Camera
from rhot.messages import MarkerFrame
from rhot.messages.objects import OpenVrPose
from services.cli.calibrate.objects.wanted import Painted
from services.cli.recorded.messages import messages

if TYPE_CHECKING:
    from services.calibrator.objects.sightings import Sightings
    from services.calibrator.objects.tracker_path import TrackerPath

# OpenVR has 64 device slots; names come from the network.
_MAX_TRACKERS = 64
# Ten minutes of four cameras at 60 Hz, and of a tracker at 250 Hz.
_MAX_MESSAGES = 150_000


@dataclass
class Recorded:
    """Messages in the order of their arrival; those beyond ten minutes are left out."""

    frames: list[MarkerFrame] = field(default_factory=list)
    poses: dict[str, list[OpenVrPose]] = field(default_factory=dict)

    def add_frame(self, frame: MarkerFrame) -> None:
        """One camera's picture."""
        if len(self.frames) < _MAX_MESSAGES:
            self.frames.append(frame)

    def add_pose(self, pose: OpenVrPose) -> None:
        """One tracker's pose."""
        serial = pose.device.serial
        if serial not in self.poses and len(self.poses) >= _MAX_TRACKERS:
            return
        own = self.poses.setdefault(serial, [])
        if len(own) < _MAX_MESSAGES:
            own.append(pose)

    def sightings(
        self, cameras: Mapping[str, Camera], painted: list[Painted]
    ) -> dict[str, Sightings]:
        """What cameras saw of each tracker's paint, by serial."""
        from services.calibrator.objects.sightings import sightings

        return {one.serial: sightings(self.frames, cameras, one.color) for one in painted}

    def paths(self) -> dict[str, TrackerPath]:
        """The path of every tracker, by serial."""
        from services.calibrator.objects.tracker_path import tracker_path

        return {serial: tracker_path(poses) for serial, poses in self.poses.items()}


def read_recording(path: Path, poses: Path | None, config: Path | None) -> Recorded:
    """A capture (its pictures are tracked first), a folder with markers.jsonl and objects.jsonl, or
    an MCAP of `rhot record`; poses, if given, is where trackers' poses are instead.

    Raises CaptureError if it has no markers or no poses of trackers, and what reading it raises.
    """
    recorded = Recorded()
    is_capture = path.is_dir() and not (path / "markers.jsonl").is_file()
    if is_capture:
        _track(path, config, recorded)
    else:
        for frame in messages(path, topics.MARKERS, MarkerFrame, "markers"):
            recorded.add_frame(frame)
    for pose in read_poses(poses or path):
        recorded.add_pose(pose)
    return recorded


def read_poses(path: Path) -> list[OpenVrPose]:
    """The poses of all trackers in a capture's objects.jsonl, another .jsonl, or an MCAP."""
    file = path / "objects.jsonl" if path.is_dir() else path
    if not file.is_file():
        raise CaptureError(f"{file}: no such file; trackers' poses are needed, as OpenVrPose lines")
    if file.suffix == ".mcap":
        return list(messages(file, topics.OPENVR, OpenVrPose, "objects"))
    try:
        return list(read_lines(file, OpenVrPose))
    except CaptureError as error:
        raise CaptureError(
            f"{error}. Poses of trackers are needed as SteamVR reports them: those of a capture, "
            "not objects that are already in the rig's frame"
        ) from None


def _track(path: Path, config: Path | None, recorded: Recorded) -> None:
    if not (path / "rig.toml").is_file():
        raise CaptureError(
            f"{path}: is no capture, no folder with markers.jsonl and objects.jsonl, and no .mcap"
        )
    from services.cli.offline.inputs import job_of
    from services.cli.offline.run import run

    with tempfile.TemporaryDirectory() as folder:
        tracked = Path(folder) / "out"
        run(job_of([str(path)], config), tracked, None)
        for frame in messages(tracked, topics.MARKERS, MarkerFrame, "markers"):
            recorded.add_frame(frame)
