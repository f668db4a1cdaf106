"""What a lens calibration finds: the fit to the pictures, the lens, and its errors. Pure data."""

from __future__ import annotations

from dataclasses import dataclass

from rhot.geometry.transforms import Array
from services.calibrator.board.board_views import LeftOut
from services.calibrator.board.coverage import Coverage, coverage
from services.calibrator.bundle.adjust import Adjustment
from services.calibrator.bundle.residuals import View


@dataclass(frozen=True, eq=False)
class LensEstimate:
    """The lens (9,) of a camera with one sigma (9,), and the coverage of its picture by corners."""

    camera: str
    size_px: tuple[int, int]
    lens: Array
    sigma: Array
    coverage: Coverage


@dataclass(frozen=True, eq=False)
class LensFit:
    """A lens adjusted to views whose boards are numbered 0..n-1; keys are the pictures' names."""

    camera: str
    size_px: tuple[int, int]
    keys: list[str]
    views: list[View]
    found: Adjustment

    def estimate(self) -> LensEstimate:
        """The lens with its sigma, and the coverage of the picture."""
        state = self.found.state
        corners = [view.pixels for view in self.views]
        covered = coverage(self.size_px, corners, list(state.T_rig_from_board))
        return LensEstimate(
            self.camera, self.size_px, state.lenses[0], self.found.lens_sigma[0], covered
        )


@dataclass(frozen=True)
class PictureError:
    """The error of one picture's corners: in the calibration, and held out of it.

    influence_percent is by how much the picture raises the error of all others, on average. suspect
    marks pictures a person should look at.
    """

    key: str
    rms_px: float
    held_out_px: float
    held_out_squares: float
    influence_percent: float
    suspect: bool = False


@dataclass(frozen=True, eq=False)
class LensResult(LensEstimate):
    """A calibrated lens and what is known of its quality.

    held_out_px and held_out_squares are RMS over the pictures, each with the lens calibrated from
    all others: in the picture, and on the board's plane in sides of its squares.
    """

    model: str
    rms_px: float
    held_out_px: float
    held_out_squares: float
    pictures: tuple[PictureError, ...]
    left_out: tuple[LeftOut, ...]
    warnings: tuple[str, ...] = ()
