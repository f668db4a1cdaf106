"""What `rhot track` reads: a capture folder, or CAM=VIDEO pairs with a rig.toml; one video alone
needs the ranges of its colours only.

Stamps come from the capture's csv, from VIDEO's own csv beside it (left.mp4, left.csv), from the
times in the video's container, or from a frame rate given by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from rhot.errors import CalibrationError, CaptureError, ConfigError, RhotError
from rhot.files.calibration import load_colors
from rhot.files.capture import CSV_HEADER, Capture, read_stamps
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import CameraTable, RigTable
from services.cli.offline.frames.camera_input import CameraInput, StampedReader
from services.cli.offline.track_summary import Origin
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.video import VideoReader

# Stamps in a csv are on one clock, as exact as the synchronised clocks of a rig are; separate
# videos have no clock in common.
_CSV_SIGMA_NS, _UNKNOWN_SIGMA_NS = 500_000, -1


@dataclass(frozen=True)
class Job:
    """All that one run reads; objects is the capture's objects.jsonl or None.

    markers is the markers.jsonl of a capture without pictures: there are no inputs then. colors are
    those to track, if not all. origin is what was asked for.
    """

    config: RigConfig
    inputs: list[CameraInput]
    objects: Path | None
    markers: Path | None = None
    colors: tuple[str, ...] = ()
    origin: Origin | None = None

    @property
    def cameras(self) -> list[str]:
        """Names of the cameras whose pictures or markers are read."""
        if self.markers is not None:
            return [camera.name for camera in self.config.camera]
        return [one.camera for one in self.inputs]


def job_of(
    sources: Sequence[str],
    config: Path | None,
    rates: Sequence[str] = (),
    colors: Sequence[str] = (),
) -> Job:
    """From the command line's arguments: one CAPTURE, or CAM=VIDEO pairs.

    rates: frame rates of videos by hand, `30` of all or `left=29.97` of one. colors: those to track
    where no rig.toml says which. Raises RhotError saying what was expected.
    """
    job = replace(_job(sources, config, rates), origin=origin_of(sources, config, rates))
    if not colors:
        return job
    if job.config.hand or job.markers is not None:
        raise ConfigError(
            "--color is for a video without rig.toml; here [hand.right.markers] says which colours"
            " are tracked"
        )
    for camera in job.cameras:
        _check_colors(job.config, camera, colors)
    return replace(job, colors=tuple(dict.fromkeys(colors)))


def origin_of(sources: Sequence[str], config: Path | None, rates: Sequence[str]) -> Origin:
    """What was asked for, so that another command in another folder finds it again."""
    named = [source.partition("=") for source in sources]
    paths = [
        f"{name}={Path(path).resolve()}" if path and not Path(source).is_dir() else source
        for source, (name, _, path) in zip(sources, named, strict=True)
    ]
    return Origin(
        sources=[path if "=" in path else str(Path(path).resolve()) for path in paths],
        config=str(config.resolve()) if config is not None else "",
        rates=list(rates),
    )


def _check_colors(config: RigConfig, camera: str, wanted: Sequence[str]) -> None:
    known = load_colors(config.calibration_dir, camera).colors
    for name in wanted:
        if name not in known:
            raise CalibrationError(
                f"--color {name}: is not in {config.calibration_dir / camera}.colors.json, which "
                f"has {', '.join(sorted(known)) or 'none'}; add it with `rhot calibrate colors "
                f"{camera} --video VIDEO`"
            )


def _job(sources: Sequence[str], config: Path | None, rates: Sequence[str]) -> Job:
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
    pairs = [_pair(source) for source in sources]
    config = _rig_of_one_video(pairs) if path is None else load_rig(path)
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


def _rig_of_one_video(pairs: Sequence[tuple[str, Path]]) -> RigConfig:
    """What stands for a rig.toml: its calibration is that of the current folder."""
    name, video = pairs[0]
    if len(pairs) > 1:
        raise ConfigError(
            f"{len(pairs)} videos need --config rig.toml, which says which colour is on which "
            "landmark; one video alone needs its colours only"
        )
    config = RigConfig(rig=RigTable(name="video"))
    colors = config.calibration_dir / f"{name}.colors.json"
    if not colors.is_file():
        raise CalibrationError(
            f"{colors}: no such file, and no --config rig.toml; make it with `rhot calibrate colors"
            f" {name} --video {video} --auto --out {config.calibration_dir}`"
        )
    return config


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
