"""The pictures of a camera that agree on a lens, and those that are left out, each with its reason.
Pure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rhot.files.calibration import LensKind
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut, board_view, same_size
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.lens_model import FX, rays_from_pixels
from services.calibrator.bundle.outliers import OUTLIER_ROUNDS, outliers
from services.calibrator.bundle.residuals import View, rms
from services.calibrator.lens.checks import MIN_VIEWS, border, check_count
from services.calibrator.lens.fit import fit_lens, fit_poses
from services.calibrator.lens.held_out import held_out_px
from services.calibrator.lens.model_selection import USUAL_MODEL
from services.calibrator.lens.result import LensFit
from services.calibrator.lens.same_place import check_places, without_copies
from services.calibrator.lens.two_lenses import check_one_lens

# A lens asks for the fisheye model where Brown-Conrady is so many px RMS off (at 640 px width), has
# left pictures out, cannot be undone at the edge of the image, or where the picture is this many
# focal lengths wide: 90 degrees.
_ASK_PX, _ASK_FOCALS = 0.35, 2.0
# ... and gets it where held-out pictures are off by less than this share of what they are else.
_BETTER = 0.99


def fit_pictures(
    camera: str, detections: dict[str, Detection], board: Board, kind: LensKind | None = None
) -> tuple[LensFit, list[LeftOut]]:
    """A lens with the richest model, fitted to the pictures that agree, and the pictures left out.

    kind is the lens model to use; None: the one with which held-out pictures fit better. Raises
    CalibrationError if too few are left, or if they are of two lenses.
    """
    size_px, kept, left_out = same_size(camera, detections)
    check_places(camera, kept, MIN_VIEWS)
    kept, copies = without_copies(camera, kept)
    left_out += copies
    check_count(camera, len(kept), left_out)
    pictures = _Pictures(camera, size_px, kept, board)
    fit, outlier_pictures = pictures.screened(fisheye=kind == "fisheye")
    if kind is None and (outlier_pictures or _asks_for_fisheye(fit)):
        wide = pictures.screened(fisheye=True)
        if pictures.is_better(wide[0], fit):
            fit, outlier_pictures = wide
    check_one_lens(camera, fit.keys, size_px, fit.views, fit.found)
    check_count(camera, len(fit.keys), [*left_out, *outlier_pictures])
    return fit, [*left_out, *outlier_pictures]


def _asks_for_fisheye(fit: LensFit) -> bool:
    width = fit.size_px[0]
    lens = fit.found.state.lenses[0]
    return (
        fit.found.rms_px > _ASK_PX * width / 640.0
        or width > _ASK_FOCALS * lens[FX]
        or not np.all(np.isfinite(rays_from_pixels(lens, border(fit.size_px))))
    )


@dataclass(frozen=True, eq=False)
class _Pictures:
    """The pictures of one camera, all of one size."""

    camera: str
    size_px: tuple[int, int]
    detections: dict[str, Detection]
    board: Board

    def screened(self, *, fisheye: bool) -> tuple[LensFit, list[LeftOut]]:
        """A lens fitted to the pictures that agree on it, and those that do not."""
        keys, left_out = list(self.detections), []
        fit = self._fit(keys, fisheye=fisheye)
        for _ in range(OUTLIER_ROUNDS):
            errors_px = [rms(residual) for residual in fit.found.residuals]
            bad = outliers(errors_px, self.size_px[0])
            if not bad or len(keys) - len(bad) < MIN_VIEWS:
                break
            median = np.median(errors_px)
            left_out += [
                LeftOut(
                    self.camera,
                    keys[k],
                    f"its corners are {errors_px[k]:.1f} px off, the others' {median:.2f}",
                )
                for k in bad
            ]
            keys = [key for k, key in enumerate(keys) if k not in bad]
            fit = self._fit(keys, fisheye=fisheye)
        return fit, left_out

    def is_better(self, one: LensFit, other: LensFit) -> bool:
        """Whether held-out pictures fit the one lens better; of all that either of them kept."""
        keys = [key for key in self.detections if key in one.keys or key in other.keys]
        errors_px = []
        for fit in (one, other):
            views = self._views(keys)
            free = USUAL_MODEL.free_of(fit.found.state.lenses[0])
            whole = fit_poses(fit.found.state.lenses[0], views, free)
            alike = replace(fit, keys=keys, views=views, found=whole)
            errors_px.append(held_out_px(alike, USUAL_MODEL))
        # Not finite: boards that this lens does not see at all.
        return bool(np.isfinite(errors_px[0]) and not errors_px[0] >= _BETTER * errors_px[1])

    def _fit(self, keys: list[str], *, fisheye: bool) -> LensFit:
        views = self._views(keys)
        free = USUAL_MODEL.fisheye_free if fisheye else USUAL_MODEL.free
        found = fit_lens(self.size_px, views, free, fisheye=fisheye)
        return LensFit(self.camera, self.size_px, keys, views, found)

    def _views(self, keys: list[str]) -> list[View]:
        return [
            board_view(self.board, self.detections[key], 0, number)
            for number, key in enumerate(keys)
        ]
