"""The path of one tracker in the lighthouses' frame: its poses, screened, at any instant. Pure.

Poses that cannot be right (not valid, not tracked, not finite, not a rotation) and poses that jump
away from their neighbours for a moment are left out. Between the rest the path is a cubic, fitted
to some poses about each instant: that averages their noise, gives velocities, and needs none of
SteamVR's own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from rhot.messages.objects import OpenVrPose
from services.calibrator.objects.path_fit import Motion, fit_motion, screen
from services.calibrator.objects.sightings import Bools, Ints

# Running_OK of ETrackingResult.
_RUNNING_OK = 200
# What is beyond is no pose; matrices of float32 stay within 2e-7 of a rotation.
_MAX_DISTANCE_M, _ROTATION_TOLERANCE = 100.0, 1e-3


@dataclass(frozen=True, eq=False)
class TrackerPath:
    """n poses of one tracker in the order of their stamps; rejected were left out.

    stamps_ns are on the master's clock as far as the sender's offset tells.
    """

    serial: str
    universe: str
    stamps_ns: Ints  # (n,)
    positions_m: Array  # (n, 3), lighthouse frame
    rotations: Array  # (n, 3, 3), R_lighthouse_from_tracker
    rejected: int

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def motion(self, stamps_ns: Ints, late_s: float = 0.0) -> Motion:
        """The tracker's motion at instants (m,), if its stamps are late by late_s."""
        if not len(self.stamps_ns):
            return Motion.nowhere(len(stamps_ns))
        begin_ns = int(self.stamps_ns[0])
        # Relative to the first: float64 cannot hold nanoseconds since 1970.
        times_s: Array = np.asarray((self.stamps_ns - begin_ns) * 1e-9, dtype=np.float64)
        at_s: Array = np.asarray((stamps_ns - begin_ns) * 1e-9 + late_s, dtype=np.float64)
        return fit_motion(times_s, self.positions_m, self.rotations, at_s)


def tracker_path(poses: Iterable[OpenVrPose]) -> TrackerPath:
    """The path of one tracker from its poses, in any order.

    Raises CalibrationError if they are of several trackers or of several universes.
    """
    serials: set[str] = set()
    universes: set[str] = set()
    rows: dict[int, tuple[float, ...]] = {}
    count = 0
    for pose in poses:
        serials.add(pose.device.serial)
        count += 1
        if not (pose.bPoseIsValid and pose.bDeviceIsConnected):
            continue
        if pose.eTrackingResult != _RUNNING_OK:
            continue
        universes.add(pose.universe)
        rows[pose.stamp_ns - pose.clock_offset_ns] = tuple(
            value for row in pose.mDeviceToAbsoluteTracking for value in row
        )
    if len(serials) > 1:
        raise CalibrationError(
            f"these are the poses of {len(serials)} trackers ({', '.join(sorted(serials))}): "
            "give those of one"
        )
    if len(universes) > 1:
        raise CalibrationError(
            "SteamVR changed its universe, and so the lighthouses' frame, while this was recorded:"
            " leave the base stations alone and record again"
        )
    stamps_ns = np.array(sorted(rows), dtype=np.int64)
    matrices = np.array([rows[stamp] for stamp in stamps_ns.tolist()]).reshape(-1, 3, 4)
    return _screened(serials, universes, stamps_ns, matrices, count)


def _screened(
    serials: set[str], universes: set[str], stamps_ns: Ints, matrices: Array, count: int
) -> TrackerPath:
    good = _possible(matrices)
    stamps_ns, matrices = stamps_ns[good], matrices[good]
    positions_m = np.ascontiguousarray(matrices[:, :, 3])
    # Exactly a rotation, at 180 deg too.
    rotations = (
        Rotation.from_matrix(matrices[:, :, :3]).as_matrix() if len(matrices) else matrices[..., :3]
    )
    times_s = (stamps_ns - (stamps_ns[0] if len(stamps_ns) else 0)) * 1e-9
    steady = screen(times_s, positions_m, rotations)
    return TrackerPath(
        serial=next(iter(serials), ""),
        universe=next(iter(universes), ""),
        stamps_ns=stamps_ns[steady],
        positions_m=positions_m[steady],
        rotations=rotations[steady],
        rejected=count - int(steady.sum()),
    )


def _possible(matrices: Array) -> Bools:
    """Which matrices (n, 3, 4) can be poses; (n,)."""
    # Written so that NaN fails; large entries first, so that products cannot overflow.
    bounded = np.all(np.abs(matrices[:, :, 3]) <= _MAX_DISTANCE_M, axis=1) & np.all(
        np.abs(matrices[:, :, :3]) <= 1.0 + _ROTATION_TOLERANCE, axis=(1, 2)
    )
    R = np.where(bounded[:, None, None], matrices[:, :, :3], 0.0)
    off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    return bounded & (off <= _ROTATION_TOLERANCE) & (np.linalg.det(R) > 0.0)
