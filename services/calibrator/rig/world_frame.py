"""`rhot calibrate world`: the world frame, on a desk, from a board that lies there. Pure.

The frame: origin in the board's first inner corner, x along its rows, z up from the desk. All
calibrated cameras that see the board share in finding it; one is enough. A board that is not seen,
or that does not fit, is a CalibrationError.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, inverse, transform
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import board_view
from services.calibrator.board.corner_order import possible_numberings
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.adjust import FreeUnknowns, adjust
from services.calibrator.bundle.initial_guess import guess_board_pose
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import State, View
from services.calibrator.bundle.views import renumbered
from services.calibrator.rig.relative_pose import nearest_numbering

# The board's z points into the desk; half a turn about x makes it point up and leaves x alone.
_T_BOARD_FROM_WORLD = np.diag([1.0, -1.0, -1.0, 1.0])
# Corners of a board that is where it seems to be are off by tenths of a pixel; a wrong calibration
# gives many.
_FITS_PX = 2.0


@dataclass(frozen=True, eq=False)
class WorldFrame:
    """T_world_from_rig (4, 4), where rig is the frame of rig.json, and how well the board fits.

    cameras are those that saw the board; rms_px is the RMS of its corners in their pictures.
    """

    T_world_from_rig: Array
    cameras: tuple[str, ...]
    rms_px: float


def find_world_frame(
    cameras: dict[str, Camera], detections: dict[str, Detection], board: Board
) -> WorldFrame:
    """The world frame from the board that calibrated cameras (in the frame of rig.json) see.

    Raises CalibrationError if no camera sees it, a picture has another size than the calibration,
    or the views do not agree.
    """
    names = _seeing(cameras, detections)
    lenses = np.stack(
        [lens_vector(cameras[name].matrix, cameras[name].distortion) for name in names]
    )
    T_camera_from_rig = np.stack([cameras[name].T_camera_from_rig for name in names])
    views = [board_view(board, detections[name], k, 0) for k, name in enumerate(names)]
    T_first_from_board = guess_board_pose(lenses[0], views[0])[0]
    T_rig_from_board = inverse(T_camera_from_rig[0]) @ T_first_from_board
    start = State(lenses, T_camera_from_rig, T_rig_from_board[None])
    views = _numbered_alike(views, start, board)
    found = adjust(views, start, FreeUnknowns.boards_only(len(names)))
    if not found.rms_px <= _FITS_PX:
        raise CalibrationError(
            f"the cameras {', '.join(names)} see the board {found.rms_px:.1f} px from where one "
            f"board could be (at most {_FITS_PX:g}); was a camera moved since `rhot calibrate "
            "stereo`, or the board between the pictures? Calibrate again, or take new pictures"
        )
    T_rig_from_world = found.state.T_rig_from_board[0] @ _T_BOARD_FROM_WORLD
    return WorldFrame(inverse(_orthonormal(T_rig_from_world)), tuple(names), found.rms_px)


def _seeing(cameras: dict[str, Camera], detections: dict[str, Detection]) -> list[str]:
    """The names of the cameras that see the board, in pictures of the calibrated size."""
    names = [name for name in cameras if name in detections]
    if not names:
        raise CalibrationError(
            "no camera sees the whole board on the desk; lay it where at least the first camera "
            "sees all of it"
        )
    for name in names:
        size_px, calibrated_px = detections[name].size_px, cameras[name].size_px
        if size_px != calibrated_px:
            raise CalibrationError(
                f"camera {name!r}: the picture is {size_px[0]}x{size_px[1]} px, its lens was "
                f"calibrated at {calibrated_px[0]}x{calibrated_px[1]}; take the picture at that "
                "size, or calibrate again"
            )
    return names


def _numbered_alike(views: list[View], start: State, board: Board) -> list[View]:
    """The views with corners numbered as the first camera's, if the board looks the same turned."""
    numberings = possible_numberings(board)
    numbered = views[:1]
    for view in views[1:]:
        expected = start.T_camera_from_rig[view.camera] @ start.T_rig_from_board[0]
        choice = nearest_numbering(start.lenses[view.camera], view, expected, numberings)
        numbered.append(renumbered(view, numberings, choice))
    return numbered


def _orthonormal(T: Array) -> Array:
    """The pose whose rotation is nearest to T's, which rounding has left a little off."""
    U, _, Vt = np.linalg.svd(T[:3, :3])
    return transform(U @ Vt, T[:3, 3])
