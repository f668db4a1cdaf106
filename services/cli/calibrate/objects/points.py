"""Reference points that were measured by other means (a laser tracker, a ruled board), with a
tracker's poses at them: --points FILE --poses FILE.

FILE of points is CSV in metres of the rig frame: x,y,z a line, as many lines as poses, in the same
order; or stamp_ns,x,y,z, and the poses within a quarter of a second of the stamp are averaged. A
line of names above is passed over.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from rhot.errors import CalibrationError, CaptureError
from rhot.geometry.transforms import Array, transform
from rhot.messages.objects import OpenVrPose

# Poses around a stamp that are one point's: the tracker rests meanwhile.
_AROUND_NS = 250_000_000
_RUNNING_OK = 200


def read_points(path: Path) -> tuple[list[int] | None, Array]:
    """Stamps (None without), and points (n, 3) in metres."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise CaptureError(f"{path}: cannot be read: {error}") from None
    if rows and not _is_number(rows[0][-1]):
        rows = rows[1:]
    if not rows or len(rows[0]) not in (3, 4):
        raise CaptureError(f"{path}: expected lines x,y,z or stamp_ns,x,y,z in metres")
    points, stamps = [], []
    for number, row in enumerate(rows, start=1):
        try:
            points.append([float(value) for value in row[-3:]])
            stamps += [int(row[0])] if len(row) == 4 else []
        except ValueError:
            raise CaptureError(f"{path}: point {number} is not x,y,z in metres: {row}") from None
        if len(row) != len(rows[0]) or not np.all(np.isfinite(points[-1])):
            raise CaptureError(f"{path}: point {number} is not like the first one: {row}")
    return stamps or None, np.array(points)


def poses_at(
    stamps_ns: list[int] | None, count: int, poses: Iterable[OpenVrPose], serial: str
) -> Array:
    """The tracker's poses (n, 4, 4) at n points.

    Raises CalibrationError if there are not as many, or none at a stamp.
    """
    own = [pose for pose in poses if pose.device.serial == serial and _is_good(pose)]
    if stamps_ns is None:
        if len(own) != count:
            raise CalibrationError(
                f"{count} points, and {len(own)} good poses of {serial}: give as many, in the same "
                "order, or points with stamps (stamp_ns,x,y,z)"
            )
        return np.array([_mean([pose]) for pose in own])
    found = []
    for stamp_ns in stamps_ns:
        near = [pose for pose in own if abs(pose.stamp_ns - stamp_ns) <= _AROUND_NS]
        if not near:
            raise CalibrationError(f"no pose of {serial} within 0.25 s of {stamp_ns}")
        found.append(_mean(near))
    return np.array(found)


def _mean(poses: list[OpenVrPose]) -> Array:
    """The mean pose (4, 4) of a tracker that rests."""
    matrices = np.array([pose.mDeviceToAbsoluteTracking for pose in poses])  # (n, 3, 4)
    U, _, Vt = np.linalg.svd(matrices[:, :, :3].mean(axis=0))
    # The rotation that is nearest to the mean.
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    return transform(R, matrices[:, :, 3].mean(axis=0))


def _is_good(pose: OpenVrPose) -> bool:
    matrix = np.array(pose.mDeviceToAbsoluteTracking)
    return (
        pose.bPoseIsValid
        and pose.bDeviceIsConnected
        and pose.eTrackingResult == _RUNNING_OK
        and bool(np.all(np.isfinite(matrix)))
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
