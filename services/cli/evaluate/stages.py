"""Where the error of a result comes from: markers against the projected truth, 3D points against
the truth's landmarks.

Poses are the third stage and are scored by scoring.py. A landmark's truth is the point that stands
for its paint (rhot.hand.landmark_point), not the joint: that is what fusion reports. Instants
outside the truth are left out.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import HandModel, forward, landmark_point
from rhot.messages import HandPoints, MarkerFrame
from services.cli.evaluate.score_math import point_error
from services.cli.evaluate.score_types import MarkerError, PointStage
from services.cli.evaluate.truth_track import HandTrack, Stamps, cubic

# A blob further than this from where its landmark is (3 % of the image's width, two finger widths
# at 0.5 m) is another thing.
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
    """Per camera and landmark: pixels between the blob and the projected landmark at the blob's own
    instant.

    landmark_of maps colours to landmarks, stamps_ns (n,) and points {landmark: (n, 3)} are the
    truth.
    """
    counts: dict[str, int] = defaultdict(int)
    errors: dict[tuple[str, str], list[Array]] = defaultdict(list)
    for frame in frames:
        if (
            frame.camera not in cameras
            or not stamps_ns[0] <= frame.stamp_ns - frame.clock_offset_ns <= stamps_ns[-1]
        ):
            continue
        counts[frame.camera] += 1
        for marker in frame.markers:
            at = frame.stamp_ns - frame.clock_offset_ns + round(marker.y_px * frame.row_time_ns)
            landmark = landmark_of.get(marker.color)
            if landmark is None or not stamps_ns[0] <= at <= stamps_ns[-1]:
                continue
            place = cubic(stamps_ns, points[landmark], np.array([at]))
            pixel = cameras[frame.camera].project(place)[0]
            errors[frame.camera, landmark].append(np.array([marker.x_px, marker.y_px]) - pixel)
    return {
        camera: {
            landmark: _marker_error(errors[camera, landmark], frames) for landmark in sorted(points)
        }
        for camera, frames in counts.items()
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
        at = np.array([stamp for stamp, _ in found[name]], dtype=np.int64)
        error = np.array([position for _, position in found[name]]) - cubic(
            stamps_ns, points[name], at
        )
        share = round(len(at) / count, 4)
        result[name] = PointStage(
            found_share=share,
            predicted_share=round(predicted[name] / len(at), 4),
            error=point_error(error),
        )
    return result


def _marker_error(errors: list[Array], frames: int) -> MarkerError:
    px = np.array(errors).reshape(-1, 2)
    lengths = np.linalg.norm(px, axis=1)
    # A projection behind the camera is NaN: such a blob cannot be its landmark either.
    near = px[lengths <= _STRAY_PX]
    bias = near.mean(axis=0) if len(near) else np.zeros(2)
    rms = np.sqrt(np.mean(near**2, axis=0)) if len(near) else np.zeros(2)
    return MarkerError(
        found_share=round(len(px) / frames, 4),
        strays=len(px) - len(near),
        bias_px=(round(float(bias[0]), 3), round(float(bias[1]), 3)),
        rms_px=(round(float(rms[0]), 3), round(float(rms[1]), 3)),
    )
