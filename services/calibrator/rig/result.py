"""What a rig calibration finds: the fit to the pictures, the rig, and its errors. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut
from services.calibrator.board.coverage import Coverage, coverage
from services.calibrator.bundle.adjust import Adjustment
from services.calibrator.bundle.cross_validation import held_out_rms
from services.calibrator.bundle.lens_model import FX
from services.calibrator.bundle.residuals import State, View, rms, rms_by_board
from services.calibrator.lens.result import LensEstimate
from services.calibrator.rig.doubts import rig_doubts
from services.calibrator.rig.held_out_error import HeldOutError


@dataclass(frozen=True, eq=False)
class RigFit:
    """A rig adjusted to views whose boards are numbered as their positions in keys."""

    names: list[str]
    sizes: list[tuple[int, int]]
    keys: list[str]
    views: list[View]
    found: Adjustment

    def position_rms_px(self) -> list[float]:
        """RMS px of every position of the board."""
        return rms_by_board(self.views, self.found.residuals, len(self.keys))


@dataclass(frozen=True)
class PositionError:
    """The error of one board position: in the calibration, and held out of it.

    held_out is None where no two cameras see the position. influence_percent is by how much the
    position raises the error of all others. suspect marks positions a person should look at.
    """

    key: str
    rms_px: float
    held_out: HeldOutError | None
    influence_percent: float
    suspect: bool = False


@dataclass(frozen=True, eq=False)
class RigResult:
    """The calibrated rig and its errors.

    state holds the lenses (c, 9) and T_camera_from_rig (c, 4, 4), the sigmas are (c, 9) and (c, 6).
    rms_px is over all corners of all cameras. held_out_squares is the RMS over all corners of all
    held-out boards, triangulated; held_out_px their RMS in the pictures; square_ratio the mean side
    of their squares over the true one, square_worst that of the position farthest from 1.
    """

    board: Board
    cameras: tuple[str, ...]
    sizes: tuple[tuple[int, int], ...]
    state: State
    lens_sigma: Array
    extrinsics_sigma: Array
    lenses_given: bool
    model: str
    rms_px: float
    camera_rms_px: tuple[float, ...]
    held_out_squares: float
    held_out_px: float
    square_ratio: float
    square_worst: float
    epipolar_px: float
    coverage: tuple[Coverage, ...]
    positions: tuple[PositionError, ...]
    left_out: tuple[LeftOut, ...]
    warnings: tuple[str, ...] = ()

    def lens_estimate(self, camera: int) -> LensEstimate:
        """The lens of one camera."""
        return LensEstimate(
            self.cameras[camera],
            self.sizes[camera],
            self.state.lenses[camera],
            self.lens_sigma[camera],
            self.coverage[camera],
        )

    def doubts(self) -> list[str]:
        """What is so unusual about the places of cameras and boards that somebody must be asked."""
        distances = [each.held_out.distance_m for each in self.positions if each.held_out]
        baselines = {
            name: float(np.linalg.norm(T[:3, 3]))
            for name, T in zip(self.cameras[1:], self.state.T_camera_from_rig[1:], strict=True)
        }
        focal_px = float(self.state.lenses[0, FX])
        return rig_doubts(self.board.square_m, baselines, float(np.median(distances)), focal_px)


class _SquareRatios(NamedTuple):
    """Measured over true sides of the squares of all held-out boards; NaN without any."""

    mean: float
    worst: float


def rig_result(
    fit: RigFit,
    board: Board,
    positions: list[PositionError],
    left_out: list[LeftOut],
    model: str | None,
) -> RigResult:
    """The figures of a fit, without warnings; model is None if the lenses were given."""
    held_out = [position.held_out for position in positions if position.held_out]
    ratios = _square_ratios(held_out)
    cameras = range(len(fit.names))
    return RigResult(
        board=board,
        cameras=tuple(fit.names),
        sizes=tuple(fit.sizes),
        state=fit.found.state,
        lens_sigma=fit.found.lens_sigma,
        extrinsics_sigma=fit.found.extrinsics_sigma,
        lenses_given=model is None,
        model=model or "as given",
        rms_px=fit.found.rms_px,
        camera_rms_px=tuple(_camera_rms_px(fit, camera) for camera in cameras),
        held_out_squares=held_out_rms([error.fit_squares for error in held_out]),
        held_out_px=held_out_rms([error.reprojection_px for error in held_out]),
        square_ratio=ratios.mean,
        square_worst=ratios.worst,
        epipolar_px=held_out_rms([error.epipolar_px for error in held_out]),
        coverage=tuple(_camera_coverage(fit, camera) for camera in cameras),
        positions=tuple(positions),
        left_out=tuple(left_out),
    )


def _square_ratios(errors: list[HeldOutError]) -> _SquareRatios:
    if not errors:
        return _SquareRatios(float("nan"), float("nan"))
    ratios = np.array([error.square_ratio for error in errors])
    return _SquareRatios(float(ratios.mean()), float(ratios[np.argmax(np.abs(ratios - 1.0))]))


def _camera_rms_px(fit: RigFit, camera: int) -> float:
    residuals = [
        residual
        for view, residual in zip(fit.views, fit.found.residuals, strict=True)
        if view.camera == camera
    ]
    return rms(np.concatenate(residuals))


def _camera_coverage(fit: RigFit, camera: int) -> Coverage:
    state = fit.found.state
    views = [view for view in fit.views if view.camera == camera]
    poses = [state.T_camera_from_rig[camera] @ state.T_rig_from_board[view.board] for view in views]
    return coverage(fit.sizes[camera], [view.pixels for view in views], poses)
