"""What `rhot track` reads: a capture folder, or CAM=VIDEO pairs with a rig.toml.

Stamps come from the capture's csv, from VIDEO's own csv beside it (left.mp4, left.csv), from the
times in the video's container, or from a frame rate given by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from rhot.errors import CaptureError, ConfigError, RhotError
from rhot.files.capture import CSV_HEADER, Capture, read_stamps
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import CameraTable
from services.cli.offline.camera_input import CameraInput, StampedReader
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.video import VideoReader

# Stamps in a csv are on one clock, as exact as the synchronised clocks of a rig are; separate
# videos have no clock in common.
_CSV_SIGMA_NS, _UNKNOWN_SIGMA_NS = 500_000, -1


@dataclass(frozen=True)
class Job:
    """All that one run reads; objects is the capture's objects.jsonl or None.

    markers is the markers.jsonl of a capture without pictures: there are no inputs then.
    """

    config: RigConfig
    inputs: list[CameraInput]
    objects: Path | None
    markers: Path | None = None

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras whose pictures or markers are read."""
        if self.markers is not None:
            return [camera.name for camera in self.config.camera]
        return [one.camera for one in self.inputs]


def job_of(sources: Sequence[str], config: Path | None, rates: Sequence[str] = ()) -> Job:
    """From the command line's arguments: one CAPTURE, or CAM=VIDEO pairs.

    rates: frame rates of videos by hand, `30` of all or `left=29.97` of one. Raises ConfigError or
    CaptureError saying what was expected.
    """
    if any("=" in source and not Path(source).is_dir() for source in sources):
        return _videos(sources, config, rates)
    if rates:
        raise ConfigError("--fps is for CAM=VIDEO; a capture has the stamps of its frames")
    if len(sources) != 1:
        raise ConfigError(
            f"expected one CAPTURE folder or CAM=VIDEO pairs, got {' '.join(sources)!r}; "
            "e.g. left=l.mp4 right=r.mp4"
        )
    return _capture(Capture(Path(sources[0])), config)


def _capture(capture: Capture, config: Path | None) -> Job:
    folder = capture.folder
    if not folder.is_dir():
        kind = "is a file" if folder.exists() else "no such folder"
        raise CaptureError(
            f"{folder}: {kind}; give a capture folder, or a video as CAM={folder} "
            "with --config rig.toml"
        )
    if config is None and not capture.rig_toml.is_file():
        raise CaptureError(f"{folder}: is no capture, it has no rig.toml; give --config rig.toml")
    rig = load_rig(config or capture.rig_toml)
    if not rig.camera:
        raise ConfigError(
            f"{config or capture.rig_toml}: has no [[camera]]; a capture's rig.toml names its "
            "cameras"
        )
    objects = capture.objects if capture.objects.exists() else None
    if capture.markers.is_file() and not any(capture.video(c.name).exists() for c in rig.camera):
        return Job(rig, [], objects, capture.markers)
    inputs = [
        CameraInput(
            camera.name,
            CaptureReader(camera.name, folder),
            _CSV_SIGMA_NS,
            _frame_count(capture.stamps(camera.name)),
        )
        for camera in rig.camera
    ]
    return Job(rig, inputs, objects)


def _videos(sources: Sequence[str], path: Path | None, rates: Sequence[str]) -> Job:
    if path is None:
        raise ConfigError(
            "CAM=VIDEO needs --config rig.toml, whose calibration/CAM.colors.json has the colours"
        )
    config = load_rig(path)
    pairs = [_pair(source) for source in sources]
    names = [name for name, _ in pairs]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigError(f"camera {twice[0]!r} is given twice; each needs its own video")
    if not config.camera:
        # A rig.toml that names no camera takes any.
        config = msgspec.structs.replace(config, camera=[CameraTable(name=name) for name in names])
    tables = {name: config.camera_named(name) for name in names}
    order = [camera.name for camera in config.camera if camera.name in tables]
    videos = dict(pairs)
    by_hand = _rates(rates, order)
    inputs = [_video_input(tables[name], videos[name], by_hand.get(name)) for name in order]
    return Job(config, inputs, None)


def _rates(texts: Sequence[str], cameras: Sequence[str]) -> dict[str, float]:
    """Frame rates by camera."""
    rates: dict[str, float] = {}
    for text in texts:
        name, _, rate = text.rpartition("=")
        if name and name not in cameras:
            raise ConfigError(
                f"--fps {text}: there is no video of a camera {name!r}; there are {list(cameras)}"
            )
        try:
            value = float(rate)
        except ValueError:
            value = 0.0
        if not 0.1 <= value <= 1000.0:
            raise ConfigError(
                f"--fps {text}: give frames a second, 0.1 to 1000, e.g. --fps 30, or of one "
                f"camera, e.g. --fps {cameras[0]}=29.97"
            )
        rates |= dict.fromkeys([name] if name else cameras, value)
    return rates


def _pair(source: str) -> tuple[str, Path]:
    """(camera, video) of CAM=VIDEO."""
    name, equals, video = source.partition("=")
    if not (name and equals and video):
        raise ConfigError(f"{source!r} is not CAM=VIDEO, e.g. left=l.mp4")
    try:
        msgspec.convert({"name": name}, CameraTable)
    except msgspec.ValidationError:
        raise ConfigError(
            f"{name!r} cannot name a camera; use letters, digits, '_', '-' and '.', "
            f"e.g. left={video}"
        ) from None
    return name, Path(video)


def _video_input(table: CameraTable, path: Path, rate: float | None) -> CameraInput:
    """rate: by hand."""
    if path.is_dir():
        folder = FolderReader(table.name, path, rate or table.fps)
        return CameraInput(table.name, folder, _UNKNOWN_SIGMA_NS)
    video, csv = VideoReader(table.name, path, table.fps, rate=rate), path.with_suffix(".csv")
    if rate is not None or not csv.is_file() or csv == path:
        return CameraInput(table.name, video, _UNKNOWN_SIGMA_NS)
    with csv.open(encoding="utf-8", errors="replace") as file:
        has_stamps = tuple(cell.strip() for cell in file.readline().split(",")) == CSV_HEADER
    if has_stamps:
        stamps = read_stamps(csv)
        # Whatever times the video has do not matter, not even damaged ones.
        video = VideoReader(table.name, path, table.fps, rate=table.fps)
        reader = StampedReader(video, csv, stamps)
        return CameraInput(table.name, reader, _CSV_SIGMA_NS, len(stamps))
    note = (
        f"{csv}: is no list of stamps (`{','.join(CSV_HEADER)}`); "
        f"camera {table.name!r} is stamped by the video's own times"
    )
    return CameraInput(table.name, video, _UNKNOWN_SIGMA_NS, notes=[note])


def _frame_count(stamps: Path) -> int:
    """Frames to expect, for the progress only.

    An error in the file is reported when it is read.
    """
    try:
        return len(read_stamps(stamps))
    except RhotError:
        return 0
