"""Refusals of the rig's refinement: recordings that cannot determine the extrinsics, and results
that are no better. Pure.
"""

from __future__ import annotations

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import inverse
from services.calibrator.recalibrate.bundle import ExtrinsicsSolution
from services.calibrator.recalibrate.held_out import HeldOutErrors, locate_markers
from services.calibrator.recalibrate.residuals import ExtrinsicsProblem

# Points that two cameras locate: 4 s of six markers at 30 fps, 12 s of a wand.
MIN_POINTS = 720
# Markers must reach over this share of the first camera's picture both ways, and over this ratio of
# distances.
_MIN_SPREAD, _MIN_DEPTH_RATIO = 0.3, 1.15
# Held out, at 640 px width: painted hands leave .2-.4 px, a wrong clock model or swapped markers
# several.
_MAX_PX = 1.5
# Sigma of a rotation (deg) and of a shift (share of the distance to the first camera) beyond which
# the old extrinsics are as good.
_MAX_ROTATION_DEG, _MAX_SHIFT = 0.3, 0.03
# With a wand whose length improves, the epipolar error may grow by this factor.
_EPIPOLAR_MARGIN = 1.02


def check_recording(problem: ExtrinsicsProblem, old: ExtrinsicsSolution, first: Camera) -> int:
    """How many points two cameras located.

    Raises CalibrationError if they are too few, or reach over too little of what the first camera
    sees.
    """
    points, _ = locate_markers(problem, old)
    points = points[points[:, 2] > 0.0]
    if len(points) < MIN_POINTS:
        raise CalibrationError(
            f"two cameras together followed markers at {len(points)} instants only, {MIN_POINTS} "
            "are needed: move the wand or hand before both for half a minute"
        )
    rays = points[:, :2] / points[:, 2:]
    extent = np.ptp(np.quantile(rays, (0.02, 0.98), axis=0), axis=0)
    share = extent * problem.focals_px[0] / np.array(first.size_px)
    near, far = np.quantile(points[:, 2], (0.05, 0.95))
    if share.min() < _MIN_SPREAD or far < _MIN_DEPTH_RATIO * near:
        raise CalibrationError(
            f"the markers covered {100 * share[0]:.0f} % of the picture's width, "
            f"{100 * share[1]:.0f} % of its height and distances of {near:.2f} to {far:.2f} m; "
            f"{100 * _MIN_SPREAD:.0f} % both ways and a ratio of {_MIN_DEPTH_RATIO} are needed: "
            "move everywhere, near and far"
        )
    return len(points)


def check_result(cameras: list[Camera], new: ExtrinsicsSolution, errors: HeldOutErrors) -> None:
    """Raises CalibrationError if the result is uncertain, or no better than the old extrinsics."""
    before_px, after_px = errors.epipolar_px
    width_px = max(camera.size_px[0] for camera in cameras)
    limit_px = _MAX_PX * max(width_px / 640.0, 1.0)
    if not after_px <= limit_px:
        raise CalibrationError(
            f"wherever the cameras are placed, their views differ by {after_px:.1f} px (limit "
            f"{limit_px:.1f}): are the lenses these cameras' own, the colours told apart, the "
            "clocks steady?"
        )
    _check_sigmas(cameras, new)
    wand_is_better = errors.wand_mm is not None and errors.wand_mm[1] < errors.wand_mm[0]
    better = after_px < before_px or (wand_is_better and after_px < _EPIPOLAR_MARGIN * before_px)
    if not better:
        raise CalibrationError(
            f"the present rig.json explains the recording as well ({before_px:.3f} px, refined "
            f"{after_px:.3f} px on held-out seconds): nothing to refine"
        )


def _check_sigmas(cameras: list[Camera], new: ExtrinsicsSolution) -> None:
    first_centre = inverse(new.T_camera_from_rig[0])[:3, 3]
    updated = zip(cameras[1:], new.sigma, new.T_camera_from_rig[1:], strict=True)
    for camera, sigma, T in updated:
        rotation_deg = float(np.degrees(sigma[:3].max()))
        shift_m = float(sigma[3:6].max())
        distance_m = float(np.linalg.norm(inverse(T)[:3, 3] - first_centre))
        if rotation_deg > _MAX_ROTATION_DEG or shift_m / max(distance_m, 1e-6) > _MAX_SHIFT:
            raise CalibrationError(
                f"camera {camera.name!r} stays uncertain by {rotation_deg:.2f} deg and "
                f"{1e3 * shift_m:.1f} mm; move the markers over the whole picture, near and far, "
                "for longer, or use a wand"
            )
