"""How far the paint on a tracker lies from where its pose and the registration put it.

Pure. The paint as cameras see it is compared with the reprojection of where it should be, and the
difference is explained twice: as a small rigid motion of the whole lighthouse frame (a base station
or a camera was moved), and as a shift of the paint on its tracker (paint rubbed off, or a hand that
hides part of it). Robust: a third of the samples may be of something else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, rotation_from_vector, transform

# What nobody's drift exceeds without being noticed otherwise; keeps directions that cameras hardly
# see (depth) where they were.
_PRIOR_M, _PRIOR_RAD = 0.05, np.deg2rad(2.0)
# A blob's centre is off by a quarter of a pixel in the same way for long: by shading and by the
# colour beside it (.1 to .15 px after unmixing, .25 to .6 without).
_COMMON_PX = 0.25
# A pose with 1 mm of noise at 0.4 m is 1.3 px; what scatters more than this is no rigid motion.
_LARGEST_SCALE_PX = 3.0
_SMALLEST_SCALE_PX = 0.2
# In units of the scatter: Tukey's constant for 95 % efficiency.
_TUKEY = 4.685
_LEAST_INLIERS = 0.6
# Without any turning of the tracker the two explain the same (1.0); with 20 deg of it and 5 mm, one
# leaves twice as much.
CLEAR_RATIO = 1.4
_STEP_M = 1e-4
# L1 comes within a tenth of the scatter in four rounds; Tukey's ends after two to four more.
_L1_ROUNDS, _ROUNDS = 4, 9
# m and rad: a hundredth of what is told.
_SMALL_STEP = 2e-5


@dataclass(frozen=True, eq=False)
class DriftSamples:
    """n sightings of one object's paint, each with the pose of its tracker at that instant."""

    p_rig: Array  # (n, 3) where the paint should be
    R_rig_from_object: Array  # (n, 3, 3)
    camera: npt.NDArray[np.int64]  # (n,) index into the cameras
    pixels: Array  # (n, 2) where it was seen


class DriftFit(NamedTuple):
    """The motion of the lighthouse frame that explains the samples best.

    Points p of the rig move by shift_m + turn_rad x (p - middle_m).
    """

    shift_m: Array  # (3,)
    turn_rad: Array  # (3,)
    middle_m: Array  # (3,) of the samples
    covariance: Array  # (6, 6) of shift_m and turn_rad, what all samples share included
    scale_px: float  # scatter that is left
    # Variance left by the best shift of the paint on its tracker, in that left by the best motion
    # of the frame. Above CLEAR_RATIO it can only be the frame; below its inverse only the paint:
    # shift_m is then the paint's, in the object's frame, and turn_rad is zero.
    paint_ratio: float

    @property
    def of_frame(self) -> bool:
        """Whether only a motion of the frame explains the samples."""
        return self.paint_ratio >= CLEAR_RATIO

    @property
    def distance_m(self) -> float:
        """Length of the shift at the middle of the samples."""
        return float(np.linalg.norm(self.shift_m))

    def significance(self, sigma_m: float = 0.0) -> float:
        """Mahalanobis length of the shift; sigma_m is the registration's own, along each axis."""
        covariance = self.covariance[:3, :3] + sigma_m**2 * np.eye(3)
        return float(np.sqrt(self.shift_m @ np.linalg.solve(covariance, self.shift_m)))

    @property
    def T_rig_from_before(self) -> Array:  # noqa: N802 - frames cancel by name
        """What is put before T_rig_from_lighthouse to explain the samples; (4, 4)."""
        R = rotation_from_vector(self.turn_rad)
        return transform(R, self.middle_m + self.shift_m - R @ self.middle_m)


def fit_drift(samples: DriftSamples, cameras: tuple[Camera, ...]) -> DriftFit | None:
    """The fit; None if neither a motion of the frame nor one of the paint explains most samples."""
    middle = samples.p_rig.mean(axis=0)
    design = np.concatenate(
        [np.broadcast_to(np.eye(3), (len(samples.p_rig), 3, 3)), _turns(samples.p_rig - middle)], 2
    )  # (n, 3, 6) displacement by (shift, turn)
    prior = np.diag([_PRIOR_M**-2] * 3 + [_PRIOR_RAD**-2] * 3)
    moved = _robust(samples, cameras, design, prior)
    paint = _robust(samples, cameras, samples.R_rig_from_object, prior[:3, :3])
    ratio = 0.0
    if moved is not None:
        ratio = (paint.scale_px / moved.scale_px) ** 2 if paint else np.inf
    if paint is not None and ratio < 1.0 / CLEAR_RATIO:
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = paint.covariance
        return DriftFit(paint.x, np.zeros(3), middle, covariance, paint.scale_px, ratio)
    if moved is None:
        return None
    return DriftFit(moved.x[:3], moved.x[3:], middle, moved.covariance, moved.scale_px, ratio)


class _Solution(NamedTuple):
    x: Array  # (k,)
    covariance: Array  # (k, k)
    scale_px: float
    squares: Array  # (n,) squared residuals, px^2


def _robust(
    samples: DriftSamples, cameras: tuple[Camera, ...], design: Array, prior: Array
) -> _Solution | None:
    """Displacements design (n, 3, k) @ x by iterated reweighting: L1 first, which a third of wrong
    samples does not carry away, then Tukey's.
    """
    count = np.bincount(samples.camera, minlength=len(cameras))[samples.camera]  # (n,)
    x = np.zeros(design.shape[2])
    solved = None
    for turn in range(_ROUNDS):
        miss, by_point = _linearised(samples, cameras, samples.p_rig + design @ x)
        by_x = by_point @ design  # (n, 2, k)
        length = np.linalg.norm(miss, axis=1)  # (n,)
        length = np.where(np.isfinite(length), length, np.inf)
        # Of a two-dimensional normal distribution, the median length is 1.177 sigma.
        scale = max(float(np.median(length)) / 1.177, _SMALLEST_SCALE_PX)
        if turn < _L1_ROUNDS:
            robust = 1.0 / np.maximum(length, _SMALLEST_SCALE_PX)
        else:
            robust = np.maximum(1.0 - (length / (_TUKEY * scale)) ** 2, 0.0) ** 2
        used = robust > 0.0
        weight = np.where(used, robust, 0.0) / (scale**2 + count * _COMMON_PX**2)  # (n,)
        miss, by_x = np.where(used[:, None], miss, 0.0), np.where(used[:, None, None], by_x, 0.0)
        hessian = np.einsum("n,nik,nil->kl", weight, by_x, by_x) + prior
        gradient = np.einsum("n,nik,ni->k", weight, by_x, miss) - prior @ x
        solved = _Solution(x, np.linalg.inv(hessian), scale, length**2)
        step = np.linalg.solve(hessian, gradient)
        if turn > _L1_ROUNDS and float(np.abs(step).max()) < _SMALL_STEP:
            break
        x = x + step
    if solved is None or solved.scale_px > _LARGEST_SCALE_PX:
        return None
    inliers = float(np.mean(solved.squares < (_TUKEY * solved.scale_px) ** 2))
    return solved if inliers >= _LEAST_INLIERS else None


def _linearised(
    samples: DriftSamples, cameras: tuple[Camera, ...], p_rig: Array
) -> tuple[Array, Array]:
    """What is missing to the pixels seen (n, 2), and the pixels' derivative by p_rig (n, 2, 3)."""
    miss, derivative = np.full((len(p_rig), 2), np.nan), np.full((len(p_rig), 2, 3), np.nan)
    for index, camera in enumerate(cameras):
        rows = samples.camera == index
        if not rows.any():
            continue
        there = camera.project(p_rig[rows])
        miss[rows] = samples.pixels[rows] - there
        for axis in range(3):
            beside = camera.project(p_rig[rows] + _STEP_M * np.eye(3)[axis])
            derivative[rows, :, axis] = (beside - there) / _STEP_M
    return miss, derivative


def _turns(r: Array) -> Array:
    """M (n, 3, 3) with M @ w = w x r for each r (n, 3)."""
    x, y, z = r.T
    zero = np.zeros(len(r))
    rows = [[zero, z, -y], [-z, zero, x], [y, -x, zero]]
    return np.moveaxis(np.array(rows), 2, 0)
