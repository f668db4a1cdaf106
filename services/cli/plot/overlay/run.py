"""`rhot plot --video`: what was found, drawn onto the pictures that it was found in.

One video for each camera, at a constant rate (constant_rate.py), in real time. Pictures and lines
of the result are matched by their numbers, so that stamps that were put right later do not matter;
two pictures are held at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from rhot.errors import CaptureError, disk_full
from rhot.files.calibration import load_rig_cameras
from rhot.files.capture import read_lines
from rhot.geometry.camera import Camera
from rhot.messages import HandPose, MarkerFrame
from services.cli.offline.frames.camera_input import CameraInput
from services.cli.offline.inputs import Job, job_of
from services.cli.offline.results import check_result
from services.cli.plot.overlay.draw import Pen, draw_hand, draw_markers
from services.cli.plot.overlay.hand_track import HandTrack, ShownHand
from services.cli.plot.overlay.legend import draw_legend, draw_time
from services.cli.plot.overlay.projection import pixels_of
from services.cli.plot.rig_of_result import rig_toml_of, summary_of_result
from services.cli.progress import Progress
from services.cli.recorded.unpacked_capture import readable
from services.cli.video.constant_rate import at_rate, rate_hz
from services.cli.video.webm import WebmWriter, video_size
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import bgr_image

# Poses that lie further apart than so many pictures have a gap between them.
_REACH_FRAMES = 2.5


@dataclass(frozen=True)
class OverlayRequest:
    """What to draw: a result's folder; pictures as `rhot track` takes them, if not those that the
    result remembers; rig_toml of who tracked, if the result does not remember it.
    """

    result: Path
    pictures: Sequence[str] = ()
    rig_toml: Path | None = None


def write_overlays(
    request: OverlayRequest, out: Path, progress: bool | None = False
) -> Iterator[tuple[Path, str]]:
    """Each camera's video, and what it is; in the order of the cameras.

    Raises RhotError if there are no pictures, or if a video cannot be written.
    """
    check_result(request.result, "markers", "poses")
    with ExitStack() as stack:
        job = _job(request, stack)
        cameras = _cameras(request, job)
        counts = summary_of_result(request.result).cameras
        total = sum(counts[one.camera].frames for one in job.inputs if one.camera in counts)
        shown = Progress("rhot plot:", total, progress)
        stack.callback(shown.end)
        try:
            out.mkdir(parents=True, exist_ok=True)
            for one in job.inputs:
                path = out / f"overlay_{one.camera}.webm"
                about = _write(request.result, one, cameras.get(one.camera), path, shown.advance)
                yield path, about
        except OSError as error:
            full = disk_full(error, out)
            raise full or CaptureError(f"{out}: cannot be written: {error}") from None


def _job(request: OverlayRequest, stack: ExitStack) -> Job:
    """The pictures of a result, as they were tracked."""
    origin = summary_of_result(request.result).origin
    give = "give them with --pictures CAPTURE, or --pictures CAM=VIDEO for each camera"
    if request.pictures:
        config = rig_toml_of(origin, request.rig_toml)
        sources = stack.enter_context(readable(request.pictures))
        rates = origin.rates if origin is not None else []
        videos = any("=" in source for source in sources)
        return job_of(sources, config, rates if videos else ())
    if origin is None:
        raise CaptureError(f"{request.result}: does not say which pictures it is of; {give}")
    sources = stack.enter_context(readable(origin.sources))
    for source in sources:
        path = Path(source.partition("=")[2] if "=" in source else source)
        if not path.exists():
            raise CaptureError(f"{path}: what was tracked is no longer there; {give}")
    job = job_of(sources, Path(origin.config) if origin.config else None, origin.rates)
    if not job.inputs:
        raise CaptureError(f"{request.result}: was tracked from markers, without pictures; {give}")
    return job


def _cameras(request: OverlayRequest, job: Job) -> dict[str, Camera]:
    """Where the cameras stand, for the hands; none are needed where there are no hands."""
    if next(read_lines(request.result / "poses.jsonl", HandPose), None) is None:
        return {}
    return load_rig_cameras(job.config, [one.camera for one in job.inputs])


def _write(
    result: Path,
    source: CameraInput,
    camera: Camera | None,
    path: Path,
    advance: Callable[[], None],
) -> str:
    """One camera's video; what it is, in words."""
    stamps_ns = [_instant_ns(frame) for frame in _lines(result, source.camera)]
    if not stamps_ns:
        raise CaptureError(
            f"{result}: has no frames of camera {source.camera!r}; give the pictures it was made of"
        )
    hz = rate_hz(source.camera, stamps_ns)
    origin_ns = _origin_ns(result)
    usual_ns = float(np.median(np.diff(stamps_ns))) if len(stamps_ns) > 1 else 1e9 / hz
    poses = read_lines(result / "poses.jsonl", HandPose) if camera is not None else iter(())
    hands = HandTrack(poses, _REACH_FRAMES * usual_ns)

    def pictures() -> Iterator[tuple[int, tuple[Frame, MarkerFrame]]]:
        for frame, line in _matched(source, _lines(result, source.camera)):
            advance()
            yield _instant_ns(line), (frame, line)

    drawn: tuple[MarkerFrame, Image] | None = None
    with ExitStack() as stack:
        video: WebmWriter | None = None
        for frame, line in at_rate(pictures(), hz):
            if drawn is None or drawn[0] is not line:
                time_s = 1e-9 * (_instant_ns(line) - origin_ns)
                drawn = line, _drawn(frame, line, hands.at(_middle_ns(line)), camera, time_s)
            if video is None:
                size_px = (drawn[1].shape[1], drawn[1].shape[0])
                video = stack.enter_context(WebmWriter(path, size_px, hz))
            video.write(drawn[1])
        if video is None:
            raise CaptureError(f"{result}: no picture of camera {source.camera!r} is in it")
    seconds = 1e-9 * (stamps_ns[-1] - stamps_ns[0])
    return f"{len(stamps_ns)} pictures, {seconds:.1f} s, at a constant {hz:.3g} Hz"


def _lines(result: Path, camera: str) -> Iterator[MarkerFrame]:
    lines = read_lines(result / "markers.jsonl", MarkerFrame)
    return (line for line in lines if line.camera == camera)


def _matched(
    source: CameraInput, lines: Iterator[MarkerFrame]
) -> Iterator[tuple[Frame, MarkerFrame]]:
    """Pictures and what was found in them, by their numbers."""
    line = next(lines, None)
    for frame in source.frames():
        while line is not None and line.seq < frame.seq:
            line = next(lines, None)
        if line is None:
            return
        if line.seq == frame.seq:
            if line.size_px != frame.size_px:
                raise CaptureError(
                    f"camera {source.camera!r}: the pictures are {frame.size_px[0]} x "
                    f"{frame.size_px[1]}, those that were tracked {line.size_px[0]} x "
                    f"{line.size_px[1]}: they are not of this result"
                )
            yield frame, line


def _origin_ns(result: Path) -> int:
    """Where a result's time begins, as in the tables of `rhot export`."""
    return next(read_lines(result / "markers.jsonl", MarkerFrame)).stamp_ns


def _instant_ns(line: MarkerFrame) -> int:
    """Of the first row, on the master's clock."""
    return line.stamp_ns - line.clock_offset_ns


def _middle_ns(line: MarkerFrame) -> int:
    """Of the middle row, for a rolling shutter: a hand's poses are of one instant."""
    return _instant_ns(line) + round(0.5 * line.size_px[1] * line.row_time_ns)


def _drawn(
    frame: Frame,
    line: MarkerFrame,
    hands: Sequence[ShownHand],
    camera: Camera | None,
    time_s: float,
) -> Image:
    """The picture with all that was found, (h, w, 3) with even sizes."""
    width, height = frame.size_px
    size_px = video_size((width, height))
    picture = bgr_image(frame)
    if size_px == (width, height):
        picture = picture.copy()
    else:
        picture = cv2.resize(picture, size_px, interpolation=cv2.INTER_AREA)
    pen = Pen(picture, size_px[0] / width)
    for hand in hands:
        if camera is not None:
            draw_hand(pen, hand.pose, pixels_of(camera, hand.joints_m))
    draw_markers(pen, line.markers)
    for hand in hands:
        draw_legend(pen, hand)
    draw_time(pen, line.camera, line.seq, time_s)
    return picture
