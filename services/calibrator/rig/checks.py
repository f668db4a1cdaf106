"""What a rig's calibration must fulfil, and the sentence a person reads where it does not. Pure."""

from __future__ import annotations

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import inverse
from services.calibrator.board.detect import Detections
from services.calibrator.lens.checks import check_lens
from services.calibrator.rig.result import RigResult

# Positions of the board that two cameras both see. Each gives six equations more than its pose has;
# below four nothing can be left out.
_MIN_HELD_OUT = 4
# With fewer positions, held-out errors are themselves uncertain by a third.
_FEW_POSITIONS = 8
# Held-out error in the pictures, px at 640 px width: the real pairs reach .2. At 2 px a board is
# bent, or moved, or a camera did.
_PX_REFUSED, _PX_WARNED = 2.0, 0.6
# Held-out board fit in squares: the real pairs reach .011. It contains the depth noise, which far,
# small boards and short baselines raise.
_SQUARES_WARNED = 0.06
# Side of the triangulated squares, off by this share. Depth is off by the same share.
_SIDE_REFUSED, _SIDE_WARNED = 0.02, 0.005
# One sigma of a camera's translation, as a share of its distance from the first camera.
_TRANSLATION_REFUSED = 0.02


def check_cameras(detections: Detections) -> None:
    """Raise CalibrationError unless two cameras or more have a board in a picture each."""
    if len(detections) < 2:
        raise CalibrationError(
            f"a rig needs pictures of two cameras or more; found {list(detections) or 'none'}. "
            "Name the pictures <camera><number>, e.g. left01.png and right01.png"
        )
    blind = [camera for camera, found in detections.items() if not found]
    if blind:
        raise CalibrationError(
            f"no picture of {', '.join(map(repr, blind))} shows the board as a whole. Is --board "
            "its number of inner corners (one less than the squares each way), is it in focus, "
            "evenly lit and completely in the picture with a white margin?"
        )


def check_rig(result: RigResult) -> tuple[str, ...]:
    """Warnings about a rig.

    Raises CalibrationError, with the reason, if it must not be used.
    """
    _refuse_held_out(result)
    _refuse_extrinsics(result)
    warnings = []
    if len(result.positions) < _FEW_POSITIONS:
        warnings.append(
            f"{len(result.positions)} positions of the board are few; 12 to 20 make the errors "
            "above trustworthy"
        )
    if not result.lenses_given:
        for k, name in enumerate(result.cameras):
            warnings += [f"{name}: {text}" for text in check_lens(result.lens_estimate(k))]
    return (*warnings, *_held_out_warnings(result), *_side_warnings(result))


def _held_out_warnings(result: RigResult) -> list[str]:
    warnings = []
    if result.held_out_px > _PX_WARNED * _width_scale(result):
        warnings.append(
            f"held-out boards are {result.held_out_px:.2f} px off (.2 is good at 640 px width); is "
            "the board flat, did it stand still, are the pictures sharp?"
        )
    elif result.held_out_squares > _SQUARES_WARNED:
        warnings.append(
            f"held-out boards are triangulated {result.held_out_squares:.3f} squares off (.02 is "
            "good): their distance is uncertain; show the board nearer, use larger squares, or set "
            "the cameras farther apart"
        )
    if abs(result.square_ratio - 1.0) > _SIDE_WARNED:
        warnings.append(
            f"triangulated squares are {100 * (result.square_ratio - 1.0):+.2f} % off; take more "
            "pictures"
        )
    suspect = [position.key for position in result.positions if position.suspect]
    if suspect:
        warnings.append(
            f"positions {', '.join(suspect)} do not fit the others well, or pull the calibration "
            "away from them; look at these pictures, or take them out"
        )
    return warnings


def _refuse_held_out(result: RigResult) -> None:
    shared = [position for position in result.positions if position.held_out]
    if len(shared) < _MIN_HELD_OUT:
        raise CalibrationError(
            f"only {len(shared)} positions of the board are seen by two cameras together, at least "
            f"{_MIN_HELD_OUT} are needed (12 to 20 are good); take more pictures of the board "
            "where two cameras see it whole"
        )
    limit_px = _PX_REFUSED * _width_scale(result)
    if not result.held_out_px <= limit_px:
        raise CalibrationError(
            f"boards left out of the calibration are {result.held_out_px:.1f} px off in the "
            f"pictures (.2 is good, {limit_px:g} the limit). Did the board stand still while the "
            "cameras took their pictures, is it flat, was no camera touched in between?"
        )
    if not abs(result.square_ratio - 1.0) <= _SIDE_REFUSED:
        raise CalibrationError(
            f"triangulated squares of boards left out are {100 * (result.square_ratio - 1.0):+.1f} "
            f"% off (at most {100 * _SIDE_REFUSED:g}); distances would be too. Take more pictures, "
            "nearer and tilted in all directions"
        )


def _refuse_extrinsics(result: RigResult) -> None:
    for k, name in enumerate(result.cameras[1:], start=1):
        baseline_m = float(np.linalg.norm(result.state.T_camera_from_rig[k][:3, 3]))
        sigma_m = float(result.extrinsics_sigma[k, 3:5].max())
        if not sigma_m <= _TRANSLATION_REFUSED * baseline_m:
            raise CalibrationError(
                f"the place of camera {name!r} is uncertain by {1e3 * sigma_m:.1f} mm of "
                f"{1e3 * baseline_m:.0f} mm (at most {100 * _TRANSLATION_REFUSED:g} %); take more "
                "pictures that both cameras see, near and tilted in all directions"
            )


def _width_scale(result: RigResult) -> float:
    """Pixels of the widest picture in pixels at 640 px width."""
    return max(width for width, _ in result.sizes) / 640.0


def _side_warnings(result: RigResult) -> list[str]:
    """A warning if `left` stands right of `right`: swapped names, or both pictures mirrored."""
    cameras = {name.lower(): k for k, name in enumerate(result.cameras)}
    if not {"left", "right"} <= set(cameras):
        return []
    T_rig_from_left = inverse(result.state.T_camera_from_rig[cameras["left"]])
    T_rig_from_right = inverse(result.state.T_camera_from_rig[cameras["right"]])
    baseline = T_rig_from_right[:3, 3] - T_rig_from_left[:3, 3]
    if float(baseline @ T_rig_from_left[:3, 0]) >= 0.0:
        return []
    warning = (
        "camera 'left' stands to the right of 'right': are the names swapped, or both pictures "
        "mirrored?"
    )
    return [warning]
