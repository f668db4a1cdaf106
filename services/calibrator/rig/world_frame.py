"""`rhot calibrate world`: the rig's frame laid onto a desk by a board that lies there. Pure.

The frame: origin in the board's first inner corner, x along its rows, z up from the desk. All
calibrated cameras that see the board share in finding it; one is enough. A board that is not seen,
or that does not fit, is a CalibrationError.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, inverse, transform
from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import turns
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.adjust import Free, adjust
from services.calibrator.bundle.initial_guess import board_pose
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import State, View
from services.calibrator.bundle.views import alone, view_of
from services.calibrator.output.calibration_files import rows

# The board's z points into the desk; half a turn about x makes it point up and leaves x alone.
_BOARD_FROM_DESK = np.diag([1.0, -1.0, -1.0, 1.0])
# Corners of a board that is where it seems to be are off by tenths of a pixel; a wrong calibration
# gives many.
_FITS_PX = 2.0


@dataclass(frozen=True, eq=False)
class Desk:
    """T_desk_from_rig (4, 4), where rig is the frame of rig.json; the cameras that saw the board.

    RMS error of its corners in px.
    """

    T_desk_from_rig: Array
    cameras: tuple[str, ...]
    rms_px: float


def find_desk(cameras: dict[str, Camera], detections: dict[str, Detection], board: Board) -> Desk:
    """The desk from what calibrated cameras (in the frame of rig.json) saw of the board on it.

    Raises CalibrationError if no camera sees it, sizes differ from the calibration's, or the views
    do not agree.
    """
    names = [name for name in cameras if name in detections]
    if not names:
        raise CalibrationError(
            "no camera sees the whole board on the desk; lay it where at least the first camera sees all of it"
        )
    for name in names:
        if detections[name].size_px != cameras[name].size_px:
            raise CalibrationError(
                f"camera {name!r}: the picture is {detections[name].size_px}, its lens was calibrated at {cameras[name].size_px}; "
                "take the picture at that size, or calibrate again"
            )
    lenses = np.stack(
        [lens_vector(cameras[name].matrix, cameras[name].distortion) for name in names]
    )
    places = np.stack([cameras[name].T_camera_from_rig for name in names])
    views = [view_of(board, detections[name], k, 0) for k, name in enumerate(names)]
    free = Free(np.zeros((len(names), 9), dtype=bool), np.zeros(len(names), dtype=bool))
    first = inverse(places[0]) @ board_pose(lenses[0], alone(views[0]))[0]
    options = (
        turns(board.cols, board.rows) if board.kind == "chessboard" else [np.arange(board.size)]
    )
    for k in range(1, len(views)):
        # Boards that look the same turned around: the numbering that agrees with the first
        # camera's.
        poses = [
            inverse(places[k]) @ board_pose(lenses[k], alone(_turned(views[k], turn, options)))[0]
            for turn in options
        ]
        nearest = int(np.argmin([np.linalg.norm(pose[:3, :2] - first[:3, :2]) for pose in poses]))
        views[k] = _turned(views[k], options[nearest], options)
    found = adjust(views, State(lenses, places, first[None]), free)
    if not found.rms_px <= _FITS_PX:
        raise CalibrationError(
            f"the cameras {', '.join(names)} see the board {found.rms_px:.1f} px from where one board could be (at most {_FITS_PX:g}); "
            "was a camera moved since `rhot calibrate stereo`, or the board between the pictures?"
        )
    T_rig_from_desk = found.state.T_rig_from_board[0] @ _BOARD_FROM_DESK
    return Desk(inverse(_orthonormal(T_rig_from_desk)), tuple(names), found.rms_px)


def desk_text(desk: Desk, first: Camera) -> str:
    """The table for rig.toml: T_rig_from_camera of the first camera, with the desk as the new rig
    frame.
    """
    T = desk.T_desk_from_rig @ first.T_rig_from_camera
    lines = ",\n".join("  [" + ", ".join(f"{value:.9g}" for value in row) + "]" for row in rows(T))
    position = T[:3, 3]
    return (
        f"# board seen by {', '.join(desk.cameras)}, {desk.rms_px:.2f} px; camera {first.name} at "
        f"{position[0]:.3f}, {position[1]:.3f}, {position[2]:.3f} m above the desk\n"
        f"# Paste into rig.toml:\n[rig.world]\nT_rig_from_camera = [\n{lines},\n]"
    )


def _turned(view: View, turn: np.ndarray, options: list[np.ndarray]) -> View:
    return replace(view, pixels=view.pixels[turn]) if len(options) > 1 else view


def _orthonormal(T: Array) -> Array:
    U, _, Vt = np.linalg.svd(T[:3, :3])
    return transform(U @ Vt, T[:3, 3])
