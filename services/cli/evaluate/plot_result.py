"""Which pictures a result gives, and what is on them; drawing itself is plots.py.

Times are seconds since the first frame. Where a marker, point or pose is missing the line breaks:
nothing is bridged.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rhot.errors import CaptureError
from rhot.files.capture import Capture, read_lines
from rhot.hand import HANDS
from rhot.messages import HandPoints, HandPose, MarkerFrame, ObjectPose
from rhot.simulator_messages import Truth
from services.cli.evaluate.plot_figures import (
    Track,
    angles_figure,
    markers_figure,
    objects_figure,
    points_figure,
    residuals_figure,
)
from services.cli.evaluate.score_math import estimate_track
from services.cli.evaluate.truth_track import hand_track, object_track
from services.cli.offline.results import check_result

# A gap of more than this many usual steps breaks the line.
_GAP_STEPS = 2.5


def plot_result(result: Path, out: Path, capture: Path | None) -> list[Path]:
    """Draw a result into the folder `out`; the pictures written.

    Raises CaptureError if the result is incomplete or empty, or if `capture` has no truth.
    """
    check_result(result, "markers", "points", "poses", "objects")
    truth = _truth(Capture(capture)) if capture is not None else []
    written = []
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, figure in _figures(result, truth):
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


def _figures(result: Path, truth: list[Truth]) -> Iterator[tuple[str, Figure]]:
    frames = list(read_lines(result / "markers.jsonl", MarkerFrame))
    if not frames:
        return
    origin_ns = min(frame.stamp_ns for frame in frames)
    for camera in sorted({frame.camera for frame in frames}):
        own = [frame for frame in frames if frame.camera == camera]
        yield (
            f"markers_{camera}",
            markers_figure(camera, own[0].size_px, *_marker_tracks(own, origin_ns)),
        )
    points = list(read_lines(result / "points.jsonl", HandPoints))
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    for hand in HANDS:
        lines = [line for line in points if line.hand == hand]
        if any(line.points for line in lines):
            yield f"points_{hand}", points_figure(hand, _point_tracks(lines, origin_ns))
        solved = sorted(
            (pose for pose in poses if pose.hand == hand), key=lambda pose: pose.stamp_ns
        )
        if solved:
            yield from _pose_figures(hand, solved, truth, origin_ns)
    objects = _object_tracks(list(read_lines(result / "objects.jsonl", ObjectPose)), origin_ns)
    if objects:
        names = [name for name in objects if any(name in line.objects for line in truth)]
        real = {name: object_track(truth, name) for name in names}
        yield (
            "objects",
            objects_figure(
                objects,
                {n: Track(_seconds(t.stamps_ns, origin_ns), t.position_m) for n, t in real.items()},
            ),
        )


def _pose_figures(
    hand: str, poses: list[HandPose], truth: list[Truth], origin_ns: int
) -> Iterator[tuple[str, Figure]]:
    estimate = estimate_track(poses)
    found = _broken(
        Track(
            _seconds(estimate.stamps_ns, origin_ns), np.rad2deg(estimate.angles_rad).reshape(-1, 20)
        )
    )
    real = None
    if any(hand in line.hands for line in truth):
        track = hand_track(truth, hand)
        real = Track(
            _seconds(track.stamps_ns, origin_ns), np.rad2deg(track.angles_rad).reshape(-1, 20)
        )
    yield f"angles_{hand}", angles_figure(hand, found, real)
    residuals = 1e3 * np.array([[finger.residual_m for finger in pose.fingers] for pose in poses])
    iterations = np.array([[float(finger.iterations) for finger in pose.fingers] for pose in poses])
    unsure = np.array([[finger.status != "solved" for finger in pose.fingers] for pose in poses])
    times_s = _seconds(estimate.stamps_ns, origin_ns)
    yield f"residuals_{hand}", residuals_figure(hand, Track(times_s, residuals), iterations, unsure)


def _marker_tracks(frames: list[MarkerFrame], origin_ns: int) -> tuple[dict[str, Track], Track]:
    """Per colour x, y in px with NaN where it was not seen; and how many markers each frame has."""
    times_s = np.array([(frame.stamp_ns - origin_ns) * 1e-9 for frame in frames])
    tracks: dict[str, Track] = {}
    for row, frame in enumerate(frames):
        for marker in frame.markers:
            track = tracks.setdefault(
                marker.color, Track(times_s, np.full((len(frames), 2), np.nan))
            )
            track.values[row] = (marker.x_px, marker.y_px)
    counts = np.array([[float(len(frame.markers))] for frame in frames])
    return dict(sorted(tracks.items())), Track(times_s, counts)


def _point_tracks(lines: list[HandPoints], origin_ns: int) -> dict[str, tuple[Track, np.ndarray]]:
    """Per landmark its position in m, NaN where absent, and which rows were only predicted."""
    lines = sorted(lines, key=lambda line: line.stamp_ns)
    times_s = np.array([(line.stamp_ns - origin_ns) * 1e-9 for line in lines])
    tracks: dict[str, tuple[Track, np.ndarray]] = {}
    for row, line in enumerate(lines):
        for point in line.points:
            empty = (
                Track(times_s, np.full((len(lines), 3), np.nan)),
                np.zeros(len(lines), dtype=bool),
            )
            track, predicted = tracks.setdefault(point.name, empty)
            track.values[row] = point.position_m
            predicted[row] = point.source == "predicted"
    return dict(sorted(tracks.items()))


def _object_tracks(poses: list[ObjectPose], origin_ns: int) -> dict[str, Track]:
    tracks = {}
    for name in sorted({pose.object for pose in poses}):
        own = sorted(
            (pose for pose in poses if pose.object == name and pose.tracking != "lost"),
            key=lambda pose: pose.stamp_ns,
        )
        if own:
            stamps = np.array([pose.stamp_ns for pose in own], dtype=np.int64)
            tracks[name] = _broken(
                Track(_seconds(stamps, origin_ns), np.array([pose.position_m for pose in own]))
            )
    return tracks


def _broken(track: Track) -> Track:
    """The track with a NaN row in each gap, so that its line breaks there."""
    steps = np.diff(track.times_s)
    if not len(steps):
        return track
    gaps = np.flatnonzero(steps > _GAP_STEPS * max(float(np.median(steps)), 1e-9)) + 1
    return Track(
        np.insert(track.times_s, gaps, track.times_s[gaps - 1]),
        np.insert(track.values, gaps, np.nan, axis=0),
    )


def _seconds(stamps_ns: np.ndarray, origin_ns: int) -> np.ndarray:
    return (stamps_ns - origin_ns) * 1e-9
