"""Recordings that a registration is made of: frames of markers, and poses of trackers."""

from __future__ import annotations

import tempfile
from pathlib import Path

from rhot import topics
from rhot.errors import CaptureError
from rhot.files.capture import read_lines
from rhot.messages import MarkerFrame
from rhot.messages.objects import OpenVrPose
from services.calibrator.objects.recorded import Recorded
from services.cli.recorded.messages import messages


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
