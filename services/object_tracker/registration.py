"""Registration of the lighthouses and the objects: calibration/objects.json as transforms.

Pure. Without the file every object has its tracker's own pose in the lighthouse frame
(Registration.registered is false). A file whose matrix is not a rigid transform is a
CalibrationError, never repaired.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import ObjectPlace, Objects, load_objects
from rhot.files.config import RigConfig
from rhot.geometry.quaternions import Quat, from_rows, normalized
from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    transform,
)
from rhot.messages import Vec3

# A matrix typed with five digits passes, a scaled or mirrored one does not.
_RIGID_TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class Placement:
    """One configured object, and how it is fixed to its tracker."""

    name: str
    T_tracker_from_object: Array  # (4, 4)
    # The same as plain numbers.
    offset_m: Vec3
    orientation_wxyz: Quat
    # From the tracker's origin to the object's.
    lever_m: float
    # How late the tracker's stamps are.
    time_offset_ns: int


@dataclass(frozen=True, eq=False)
class Registration:
    """What turns a tracker's pose into an object's; placements are keyed by serial."""

    registered: bool
    T_rig_from_lighthouse: Array  # (4, 4), identity while registered is false
    placements: dict[str, Placement]
    # The transform as plain numbers.
    position_m: Vec3 = (0.0, 0.0, 0.0)
    orientation_wxyz: Quat = (1.0, 0.0, 0.0, 0.0)
    # Standard deviations of the transform: of its turn, and of its shift at middle_m (rig frame);
    # 0 and None where objects.json tells none.
    sigma_rad: float = 0.0
    sigma_m: float = 0.0
    middle_m: Vec3 | None = None


def register(config: RigConfig, objects: Objects | None) -> Registration:
    """The registration of the objects in rig.toml; objects is None if none was calibrated.

    An object without an entry in objects.json has the pose of its tracker, without an offset.
    Raises CalibrationError if objects.json has a matrix that is not a rigid transform, or a
    quaternion that is not a unit quaternion.
    """
    places = objects.objects if objects else {}
    placements = {
        o.serial: _placement(o.name, places.get(o.name, ObjectPlace())) for o in config.object
    }
    if objects is None:
        return Registration(
            registered=False, T_rig_from_lighthouse=np.eye(4), placements=placements
        )
    T = _rigid(np.array(objects.T_rig_from_lighthouse))
    x, y, z = T[:3, 3].tolist()
    return Registration(
        registered=True,
        T_rig_from_lighthouse=T,
        placements=placements,
        position_m=(x, y, z),
        orientation_wxyz=from_rows(objects.T_rig_from_lighthouse[:3]),
        sigma_rad=_sigma(objects.sigma_rad),
        sigma_m=_sigma(objects.sigma_m),
        middle_m=objects.middle_m,
    )


def corrected(known: Registration, T_rig_from_before: Array) -> Registration:
    """A registration before which a small rigid motion (4, 4) is put."""
    T = T_rig_from_before @ known.T_rig_from_lighthouse
    x, y, z = T[:3, 3].tolist()
    w, i, j, k = quaternion_from_rotation(T[:3, :3]).tolist()
    return replace(
        known, T_rig_from_lighthouse=T, position_m=(x, y, z), orientation_wxyz=(w, i, j, k)
    )


def load_registration(config: RigConfig) -> Objects | None:
    """calibration/objects.json of a rig, or None if objects were not calibrated yet."""
    if not Path(config.calibration_dir / "objects.json").exists():
        return None
    return load_objects(config.calibration_dir)


def is_rotation(R: Array, tolerance: float) -> bool:
    """Whether R (3, 3) is a right-handed rotation: R R^T within `tolerance` of the identity."""
    # Large entries are refused first, so that the products below cannot overflow.
    if not np.all(np.abs(R) <= 1.0 + tolerance):
        return False
    return bool(np.abs(R @ R.T - np.eye(3)).max() <= tolerance and np.linalg.det(R) > 0.0)


def _placement(name: str, place: ObjectPlace) -> Placement:
    q = np.array(place.orientation_wxyz)
    offset_m = np.array(place.offset_m)
    # 1e-3: the length of a quaternion typed with four digits; a zero one has no direction at all.
    if not np.all(np.isfinite(offset_m)) or not abs(float(np.hypot.reduce(q)) - 1.0) < 1e-3:
        raise CalibrationError(
            f"objects.json: {name!r} needs a finite offset_m and a unit quaternion wxyz;"
            " run `rhot calibrate objects` again"
        )
    return Placement(
        name=name,
        T_tracker_from_object=transform(rotation_from_quaternion(q), offset_m),
        offset_m=place.offset_m,
        orientation_wxyz=normalized(place.orientation_wxyz),
        lever_m=math.hypot(*place.offset_m),
        time_offset_ns=place.time_offset_ns,
    )


def _sigma(sigma: float | None) -> float:
    """A standard deviation of the file, as far as it can be one."""
    return sigma if sigma is not None and 0.0 <= sigma < math.inf else 0.0


def _rigid(T: Array) -> Array:
    bottom = np.array([0.0, 0.0, 0.0, 1.0])
    if (
        not np.all(np.isfinite(T))
        or not is_rotation(T[:3, :3], _RIGID_TOLERANCE)
        or np.abs(T[3] - bottom).max() > _RIGID_TOLERANCE
    ):
        raise CalibrationError(
            "objects.json: T_rig_from_lighthouse is not a rigid transform (rotation and metres);"
            " run `rhot calibrate objects` again"
        )
    return T
