"""Which pictures a result gives, and what is on them; figures.py and objects.py draw them.

Times are seconds since the first frame. Where a marker, point or pose is missing, the line breaks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rhot.errors import CaptureError
from rhot.files.calibration import load_hand
from rhot.files.capture import Capture, read_lines
from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.hand import HANDS, HandModel, HandName, default_hand
from rhot.messages import HandPoints, HandPose, MarkerFrame
from rhot.messages.objects import ObjectPose
from rhot.messages.simulator import Truth
from services.cli.evaluate.interpolation import Stamps
from services.cli.evaluate.score_math import estimate_track
from services.cli.evaluate.truth_track import HandTrack, hand_track
from services.cli.offline.results import check_result
from services.cli.plot.axes import Track, with_gaps
from services.cli.plot.figures import (
    angles_figure,
    markers_figure,
    points_figure,
    residuals_figure,
)
from services.cli.plot.objects import drawings, objects_figure
from services.cli.plot.rig_of_result import rig_of_result

Flags = npt.NDArray[np.bool_]


class _Stamped(Protocol):
    @property
    def stamp_ns(self) -> int: ...


M = TypeVar("M", bound=_Stamped)


def plot_result(
    result: Path, out: Path, capture: Path | None, rig_toml: Path | None = None
) -> list[Path]:
    """Draw a result into the folder `out`; the pictures written.

    capture: whose truth is drawn beside; rig_toml: of a recording, whose hand has limits. Raises
    CaptureError if the result is incomplete or empty, or if `capture` has no truth.
    """
    check_result(result, "markers", "points", "poses", "objects")
    truth = _truth(Capture(capture)) if capture is not None else []
    written = []
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, figure in _figures(result, truth, rig_of_result(result, rig_toml)):
            path = out / f"{name}.png"
            FigureCanvasAgg(figure).print_png(str(path))
            written.append(path)
    except OSError as error:
        raise CaptureError(f"{out}: pictures cannot be written: {error}") from None
    if not written:
        raise CaptureError(f"{result}: holds nothing to draw; its summary.json says why")
    return written


def _truth(capture: Capture) -> list[Truth]:
    if not capture.truth.is_file():
        raise CaptureError(
            f"{capture.folder}: has no truth.jsonl; only captures of `rhot simulate` have one"
        )
    return list(read_lines(capture.truth, Truth))


def _figures(
    result: Path, truth: list[Truth], rig: RigConfig | None
) -> Iterator[tuple[str, Figure]]:
    """(name, figure) of everything the result holds."""
    frames = list(read_lines(result / "markers.jsonl", MarkerFrame))
    if not frames:
        return
    origin_ns = min(frame.stamp_ns for frame in frames)
    for camera in sorted({frame.camera for frame in frames}):
        own = [frame for frame in frames if frame.camera == camera]
        figure = markers_figure(camera, own[0].size_px, *_marker_tracks(own, origin_ns))
        yield f"markers_{camera}", figure
    points = list(read_lines(result / "points.jsonl", HandPoints))
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    for hand in HANDS:
        lines = [line for line in points if line.hand == hand]
        if any(line.points for line in lines):
            yield f"points_{hand}", points_figure(hand, _point_tracks(lines, origin_ns))
        solved = _by_stamp(pose for pose in poses if pose.hand == hand)
        if solved:
            yield from _pose_figures(_model(rig, hand), solved, truth, origin_ns)
    objects = drawings(list(read_lines(result / "objects.jsonl", ObjectPose)), truth, origin_ns)
    if objects:
        yield "objects", objects_figure(objects)


def _model(rig: RigConfig | None, hand: HandName) -> HandModel:
    """The hand that was tracked, for its limits; the tables' where its rig is not known."""
    if rig is None or hand not in rig.hand:
        return default_hand(hand)
    return load_hand(rig.calibration_dir, hand, rig.hand[hand].scale)


def _pose_figures(
    model: HandModel, poses: list[HandPose], truth: list[Truth], origin_ns: int
) -> Iterator[tuple[str, Figure]]:
    hand = model.hand
    estimate = estimate_track(poses)
    found = _angles_track(estimate, origin_ns)
    # One sigma a digit, of those of its angles that can move.
    sigma_rad = [[finger.sigma_rad for finger in pose.fingers] for pose in poses]
    sigma_deg = np.rad2deg(np.array(sigma_rad, dtype=np.float64)).repeat(4, axis=1)  # (n, 20)
    angles = with_gaps(Track(found.times_s, found.values, sigma_deg))
    true_angles = None
    if any(hand in line.hands for line in truth):
        true_angles = _angles_track(hand_track(truth, hand), origin_ns)
    limits_deg = np.rad2deg(model.limits_rad).reshape(20, 2)
    measured = model.origin != "tables"
    figure = angles_figure(hand, angles, true_angles, limits_deg, measured=measured)
    yield f"angles_{hand}", figure
    fingers = [pose.fingers for pose in poses]
    residuals_mm = 1e3 * np.array([[finger.residual_m for finger in row] for row in fingers])
    iterations = np.array([[float(finger.iterations) for finger in row] for row in fingers])
    unsolved = np.array([[finger.status != "solved" for finger in row] for row in fingers])
    residuals = Track(_seconds(estimate.stamps_ns, origin_ns), residuals_mm)
    yield f"residuals_{hand}", residuals_figure(hand, residuals, iterations, unsolved)


def _angles_track(track: HandTrack, origin_ns: int) -> Track:
    """All 20 angles in deg."""
    angles_deg = np.rad2deg(track.angles_rad).reshape(-1, 20)
    return Track(_seconds(track.stamps_ns, origin_ns), angles_deg)


def _marker_tracks(frames: list[MarkerFrame], origin_ns: int) -> tuple[dict[str, Track], Track]:
    """Per colour x, y in px, NaN where it was not seen; and the number of markers per frame."""
    times_s = _times(frames, origin_ns)
    tracks: dict[str, Track] = {}
    for row, frame in enumerate(frames):
        for marker in frame.markers:
            track = tracks.setdefault(
                marker.color, Track(times_s, np.full((len(frames), 2), np.nan))
            )
            track.values[row] = (marker.x_px, marker.y_px)
    counts = np.array([[float(len(frame.markers))] for frame in frames])
    return dict(sorted(tracks.items())), Track(times_s, counts)


def _point_tracks(lines: list[HandPoints], origin_ns: int) -> dict[str, tuple[Track, Flags]]:
    """Per landmark its position in m, NaN where absent, and which rows were only predicted."""
    lines = _by_stamp(lines)
    times_s = _times(lines, origin_ns)
    tracks: dict[str, tuple[Track, Flags]] = {}
    for row, line in enumerate(lines):
        for point in line.points:
            empty = (
                Track(times_s, *np.full((2, len(lines), 3), np.nan)),
                np.zeros(len(lines), dtype=bool),
            )
            track, predicted = tracks.setdefault(point.name, empty)
            track.values[row] = point.position_m
            if track.sigma is not None:
                track.sigma[row] = point.sigma_m
            predicted[row] = point.source == "predicted"
    return dict(sorted(tracks.items()))


def _by_stamp(messages: Iterable[M]) -> list[M]:
    return sorted(messages, key=lambda message: message.stamp_ns)


def _times(messages: Iterable[_Stamped], origin_ns: int) -> Array:
    return np.array([(message.stamp_ns - origin_ns) * 1e-9 for message in messages])


def _seconds(stamps_ns: Stamps, origin_ns: int) -> Array:
    return np.asarray((stamps_ns - origin_ns) * 1e-9, dtype=np.float64)
