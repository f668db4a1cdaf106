"""What `rhot track` reads: a capture folder, or CAM=VIDEO pairs with a rig.toml.

A video that breaks off gives its frames up to there and a warning; one that gives none at all is an
error. Stamps come from the capture's csv, from VIDEO's own csv beside it (left.mp4, left.csv), or
from the frame rate.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import msgspec

from rhot.errors import CaptureError, ConfigError, RhotError
from rhot.files.capture import CSV_HEADER, Capture, FrameStamp, read_stamps
from rhot.files.config import CameraTable, RigConfig, load_rig
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.video import VideoReader

# Stamps in a csv are on one clock, to what synchronised clocks of a rig keep; separate videos share
# none.
_CSV_SIGMA_NS, _UNKNOWN_SIGMA_NS = 500_000, -1


class _Reader(Protocol):
    def open(self) -> None: ...

    def read(self) -> Frame | None: ...

    def close(self) -> None: ...


@dataclass
class Input:
    """One camera's recording. warnings fill while it is read.

    Total is 0 where the number of frames is unknown; notes are for people.
    """

    camera: str
    reader: _Reader
    clock_sigma_ns: int
    total: int = 0
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def frames(self) -> Iterator[Frame]:
        """Every frame that can be read, in order.

        Raises RhotError if there is none.
        """
        count, last_ns = 0, -1
        try:
            self.reader.open()
            while (frame := self.reader.read()) is not None:
                if frame.stamp_ns <= last_ns:
                    raise CaptureError(
                        f"camera {self.camera!r}: frame {frame.seq} is not later than the one before; its stamps are damaged"
                    )
                last_ns = frame.stamp_ns
                count += 1
                yield frame
        except CaptureError as broken:
            if not count:
                raise
            self.warnings.append(str(broken))
        finally:
            self.reader.close()
        if not count:
            raise CaptureError(f"camera {self.camera!r}: no frame could be read")


class StampedReader:
    """A video whose stamps come from a csv beside it.

    The shorter of the two counts, and a difference is a CaptureError at the end.
    """

    def __init__(self, video: VideoReader, path: Path, stamps: list[FrameStamp]) -> None:
        self._video, self._path, self._stamps = video, path, stamps

    def open(self) -> None:
        """As Reader.open."""
        self._video.open()

    def read(self) -> Frame | None:
        """As Reader.read."""
        frame = self._video.read()
        count = len(self._stamps)
        if frame is None:
            return None
        if frame.seq >= count:
            raise CaptureError(
                f"{self._path}: has stamps of {count} frames, the video has more; the rest was left out"
            )
        stamp = self._stamps[frame.seq]
        return replace(
            frame, seq=stamp.frame, stamp_ns=stamp.stamp_ns, row_time_ns=stamp.row_time_ns
        )

    def close(self) -> None:
        """As Reader.close."""
        self._video.close()


@dataclass(frozen=True)
class Job:
    """All that one run reads; objects is the capture's objects.jsonl or None."""

    config: RigConfig
    inputs: list[Input]
    objects: Path | None


def job_of(sources: Sequence[str], config: Path | None) -> Job:
    """From the command line's arguments: one CAPTURE, or CAM=VIDEO pairs.

    Raises ConfigError or CaptureError saying what was expected.
    """
    if any("=" in source and not Path(source).is_dir() for source in sources):
        return _videos(sources, config)
    if len(sources) != 1:
        raise ConfigError(
            f"expected one CAPTURE folder or CAM=VIDEO pairs, got {' '.join(sources)!r}; e.g. left=l.mp4 right=r.mp4"
        )
    return _capture(Capture(Path(sources[0])), config)


def _capture(capture: Capture, config: Path | None) -> Job:
    if not capture.folder.is_dir():
        kind = "is a file" if capture.folder.exists() else "no such folder"
        raise CaptureError(
            f"{capture.folder}: {kind}; give a capture folder, or a video as CAM={capture.folder} with --config rig.toml"
        )
    if config is None and not capture.rig_toml.is_file():
        raise CaptureError(
            f"{capture.folder}: is no capture, it has no rig.toml; give --config rig.toml"
        )
    rig = load_rig(config or capture.rig_toml)
    if not rig.camera:
        raise ConfigError(
            f"{config or capture.rig_toml}: has no [[camera]]; a capture's rig.toml names its cameras"
        )
    inputs = [
        Input(
            c.name,
            CaptureReader(c.name, capture.folder),
            _CSV_SIGMA_NS,
            _count(capture.stamps(c.name)),
        )
        for c in rig.camera
    ]
    return Job(rig, inputs, capture.objects if capture.objects.exists() else None)


def _videos(sources: Sequence[str], path: Path | None) -> Job:
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
    return Job(config, [_input(tables[name], videos[name]) for name in order], None)


def _pair(source: str) -> tuple[str, Path]:
    name, equals, video = source.partition("=")
    if not (name and equals and video):
        raise ConfigError(f"{source!r} is not CAM=VIDEO, e.g. left=l.mp4")
    try:
        msgspec.convert({"name": name}, CameraTable)
    except msgspec.ValidationError:
        raise ConfigError(
            f"{name!r} cannot name a camera; use letters, digits, '_', '-' and '.', e.g. left={video}"
        ) from None
    return name, Path(video)


def _input(table: CameraTable, path: Path) -> Input:
    if path.is_dir():
        return Input(table.name, FolderReader(table.name, path, table.fps), _UNKNOWN_SIGMA_NS)
    video, csv = VideoReader(table.name, path, table.fps), path.with_suffix(".csv")
    if not csv.is_file() or csv == path:
        return Input(table.name, video, _UNKNOWN_SIGMA_NS)
    with csv.open(encoding="utf-8", errors="replace") as file:
        ours = tuple(cell.strip() for cell in file.readline().split(",")) == CSV_HEADER
    if ours:
        stamps = read_stamps(csv)
        return Input(table.name, StampedReader(video, csv, stamps), _CSV_SIGMA_NS, len(stamps))
    told = f"{csv}: is no list of stamps (`{','.join(CSV_HEADER)}`); camera {table.name!r} is stamped by its frame rate"
    return Input(table.name, video, _UNKNOWN_SIGMA_NS, notes=[told])


def _count(stamps: Path) -> int:
    """Frames to expect, for the progress only.

    What is wrong with the file is told when it is read.
    """
    try:
        return len(read_stamps(stamps))
    except RhotError:
        return 0
