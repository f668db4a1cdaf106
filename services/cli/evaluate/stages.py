"""Errors of the stages before the pose: markers against the projected truth, points in 3D.

Poses are the third stage (score_math.py). A landmark's truth is the point that stands for its paint
(rhot.hand.landmark_point), not the joint: that is what fusion reports. Instants outside the truth
are left out.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import HandModel, forward, landmark_point
from rhot.messages import HandPoints, MarkerFrame
from services.cli.evaluate.interpolation import Stamps, cubic
from services.cli.evaluate.score_statistics import point_error
from services.cli.evaluate.score_types import MarkerError, PointStage
from services.cli.evaluate.truth_track import HandTrack

# A blob further than this from its landmark (3 % of the image's width, two finger widths at 0.5 m)
# is a false detection.
_STRAY_PX = 20.0


def landmark_truth(model: HandModel, truth: HandTrack, names: Iterable[str]) -> dict[str, Array]:
    """Each landmark's point at every instant of truth; {name: (n, 3)} in the rig frame, metres."""
    names = list(names)
    points = np.zeros((len(names), len(truth.stamps_ns), 3))
    for i in range(len(truth.stamps_ns)):
        joints = forward(
            model,
            rotation_from_quaternion(truth.wrist_wxyz[i]),
            truth.wrist_m[i],
            truth.angles_rad[i],
        )
        for row, name in enumerate(names):
            points[row, i] = landmark_point(model, name, *joints)
    return dict(zip(names, points, strict=True))


def marker_errors(
    frames: Iterable[MarkerFrame],
    cameras: Mapping[str, Camera],
    landmark_of: Mapping[str, str],
    stamps_ns: Stamps,
    points: Mapping[str, Array],
) -> dict[str, dict[str, MarkerError]]:
    """Per camera and landmark: blob minus projected landmark in px, at the blob's own instant.

    landmark_of maps colours to landmarks; stamps_ns (n,) and points {landmark: (n, 3)} are the
    truth.
    """
    counts: dict[str, int] = defaultdict(int)
    errors: dict[tuple[str, str], list[Array]] = defaultdict(list)
    first_ns, last_ns = stamps_ns[0], stamps_ns[-1]
    for frame in frames:
        frame_ns = frame.stamp_ns - frame.clock_offset_ns
        if frame.camera not in cameras or not first_ns <= frame_ns <= last_ns:
            continue
        counts[frame.camera] += 1
        for marker in frame.markers:
            # The shutter rolls: each row has its own instant.
            marker_ns = frame_ns + round(marker.y_px * frame.row_time_ns)
            landmark = landmark_of.get(marker.color)
            if landmark is None or not first_ns <= marker_ns <= last_ns:
                continue
            position_m = cubic(stamps_ns, points[landmark], np.array([marker_ns]))
            projected_px = cameras[frame.camera].project(position_m)[0]
            error_px = np.array([marker.x_px, marker.y_px]) - projected_px
            errors[frame.camera, landmark].append(error_px)
    return {
        camera: {
            landmark: _marker_error(errors[camera, landmark], count) for landmark in sorted(points)
        }
        for camera, count in counts.items()
    }


def point_errors(
    lines: Iterable[HandPoints], stamps_ns: Stamps, points: Mapping[str, Array]
) -> dict[str, PointStage]:
    """Per landmark: 3D points against the truth's landmark points."""
    found: dict[str, list[tuple[int, Array]]] = defaultdict(list)
    predicted: dict[str, int] = defaultdict(int)
    count = 0
    for line in lines:
        if not stamps_ns[0] <= line.stamp_ns <= stamps_ns[-1]:
            continue
        count += 1
        for point in line.points:
            if point.name in points:
                found[point.name].append((line.stamp_ns, np.array(point.position_m)))
                predicted[point.name] += point.source == "predicted"
    result = {}
    for name in sorted(found):
        found_ns = np.array([stamp for stamp, _ in found[name]], dtype=np.int64)
        positions_m = np.array([position for _, position in found[name]])  # (m, 3)
        result[name] = PointStage(
            found_share=round(len(found_ns) / count, 4),
            predicted_share=round(predicted[name] / len(found_ns), 4),
            error=point_error(positions_m - cubic(stamps_ns, points[name], found_ns)),
        )
    return result


def _marker_error(errors: list[Array], frames: int) -> MarkerError:
    errors_px = np.array(errors).reshape(-1, 2)  # (m, 2)
    lengths = np.linalg.norm(errors_px, axis=1)
    # A projection behind the camera is NaN: such a blob cannot be its landmark either.
    inliers = errors_px[lengths <= _STRAY_PX]
    bias = inliers.mean(axis=0) if len(inliers) else np.zeros(2)
    rms = np.sqrt(np.mean(inliers**2, axis=0)) if len(inliers) else np.zeros(2)
    return MarkerError(
        found_share=round(len(errors_px) / frames, 4),
        strays=len(errors_px) - len(inliers),
        bias_px=(round(float(bias[0]), 3), round(float(bias[1]), 3)),
        rms_px=(round(float(rms[0]), 3), round(float(rms[1]), 3)),
    )
