"""What a rig's calibration must fulfil, and the sentence a person reads where it does not. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import inverse
from services.calibrator.board.detect import Detection
from services.calibrator.lens.checks import check_lens

if TYPE_CHECKING:
    from services.calibrator.rig.calibrate import RigResult

# Boards that two cameras both see. Each gives six equations more than its pose has; below four
# nothing can be left out.
_MIN_HELD_OUT = 4
# Below this, held-out errors are themselves uncertain by a third.
_GOOD = 8
# Held-out error in the pictures, px at 640 px width: the real pairs reach .2. At 2 px a board is
# bent, or moved, or a camera did.
_PX_REFUSED, _PX_WARNED = 2.0, 0.6
# Held-out board fit in squares: the real pairs reach .011. It contains the depth noise, which far,
# small boards and short baselines raise.
_SQUARES_WARNED = 0.06
# Side of the triangulated squares. Depth is off by the same share.
_SIDE_REFUSED, _SIDE_WARNED = 0.02, 0.005
# One sigma of a camera's place, as a share of its distance from the first camera.
_PLACE_REFUSED = 0.02


def check_shared(detections: dict[str, dict[str, Detection]]) -> None:
    """Raise CalibrationError if there are not two cameras with a board in at least one picture
    each.
    """
    if len(detections) < 2:
        raise CalibrationError(
            f"a rig needs pictures of two cameras or more; found {list(detections) or 'none'}"
        )
    blind = [camera for camera, found in detections.items() if not found]
    if blind:
        raise CalibrationError(
            f"no picture of {', '.join(map(repr, blind))} shows the board as a whole. Is --board its number of inner corners (one less "
            "than the squares each way), is it in focus, evenly lit and completely in the picture with a white margin?"
        )


def check_rig(result: RigResult) -> tuple[str, ...]:
    """Warnings about a rig.

    Raises CalibrationError, with the reason, if it must not be used.
    """
    _refuse(result)
    warnings = []
    if len(result.positions) < _GOOD:
        warnings.append(
            f"{len(result.positions)} positions of the board are few; 12 to 20 make the errors above trustworthy"
        )
    for k, name in enumerate(result.cameras):
        if not result.lenses_given:
            said = check_lens(
                name,
                result.sizes[k],
                result.state.lenses[k],
                result.lens_sigma[k],
                0.0,
                result.coverage[k],
            )
            warnings += [f"{name}: {warning}" for warning in said]
    if result.held_out_px > _PX_WARNED * _scale(result):
        warnings.append(
            f"held-out boards are {result.held_out_px:.2f} px off (.2 is good at 640 px width); is the board flat, did it stand still, are "
            "the pictures sharp?"
        )
    elif result.held_out_squares > _SQUARES_WARNED:
        warnings.append(
            f"held-out boards are triangulated {result.held_out_squares:.3f} squares off (.02 is good): their distance is uncertain; "
            "show the board nearer, use larger squares, or set the cameras farther apart"
        )
    if abs(result.square_ratio - 1.0) > _SIDE_WARNED:
        warnings.append(
            f"triangulated squares are {100 * (result.square_ratio - 1.0):+.2f} % off; take more pictures"
        )
    worst = [position.key for position in result.positions if position.hurts]
    if worst:
        warnings.append(
            f"positions {', '.join(worst)} do not fit the others well, or pull the calibration away from them; look at these "
            "pictures, or take them out"
        )
    return (*warnings, *_sides(result))


def _refuse(result: RigResult) -> None:
    held_out = [position for position in result.positions if position.held_out]
    if len(held_out) < _MIN_HELD_OUT:
        raise CalibrationError(
            f"only {len(held_out)} positions of the board are seen by two cameras together, at least {_MIN_HELD_OUT} are "
            "needed (12 to 20 are good)"
        )
    if not result.held_out_px <= _PX_REFUSED * _scale(result):
        raise CalibrationError(
            f"boards left out of the calibration are {result.held_out_px:.1f} px off in the pictures (.2 is good, "
            f"{_PX_REFUSED * _scale(result):g} the limit). Did the board stand still while the cameras took their pictures, "
            "is it flat, was no camera touched in between?"
        )
    if not abs(result.square_ratio - 1.0) <= _SIDE_REFUSED:
        raise CalibrationError(
            f"triangulated squares of boards left out are {100 * (result.square_ratio - 1.0):+.1f} % off; distances would be too. "
            "Take more pictures, nearer and tilted in all directions"
        )
    for k, name in enumerate(result.cameras[1:], start=1):
        baseline = float(np.linalg.norm(result.state.T_camera_from_rig[k][:3, 3]))
        sigma = float(result.place_sigma[k, 3:5].max())
        if not sigma <= _PLACE_REFUSED * baseline:
            raise CalibrationError(
                f"the place of camera {name!r} is uncertain by {1e3 * sigma:.1f} mm of {1e3 * baseline:.0f} mm; take more "
                "pictures that both cameras see, near and tilted in all directions"
            )


def _scale(result: RigResult) -> float:
    """Pixels of the widest picture in pixels at 640 px width."""
    return max(width for width, _ in result.sizes) / 640.0


def _sides(result: RigResult) -> tuple[str, ...]:
    """A note if `left` stands right of `right`: swapped names, or both pictures mirrored."""
    sides = {name.lower(): k for k, name in enumerate(result.cameras)}
    if not {"left", "right"} <= set(sides):
        return ()
    left, right = (
        inverse(result.state.T_camera_from_rig[sides[side]]) for side in ("left", "right")
    )
    across = float((right[:3, 3] - left[:3, 3]) @ left[:3, 0])
    if across >= 0.0:
        return ()
    return (
        "camera 'left' stands to the right of 'right': are the names swapped, or both pictures mirrored?",
    )
