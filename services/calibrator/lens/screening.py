"""The pictures of a camera that agree on a lens, and those that are left out, each with its reason.
Pure.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut, board_view, same_size
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.outliers import OUTLIER_ROUNDS, outliers
from services.calibrator.bundle.residuals import rms
from services.calibrator.lens.checks import MIN_VIEWS, check_count
from services.calibrator.lens.fit import fit_lens
from services.calibrator.lens.model_selection import USUAL_MODEL
from services.calibrator.lens.result import LensFit
from services.calibrator.lens.same_place import check_places, without_copies
from services.calibrator.lens.two_lenses import check_one_lens


def fit_pictures(
    camera: str, detections: dict[str, Detection], board: Board
) -> tuple[LensFit, list[LeftOut]]:
    """The usual lens model fitted to the pictures that agree, and the pictures left out.

    Raises CalibrationError if too few are left.
    """
    size_px, kept, left_out = same_size(camera, detections)
    check_places(camera, kept, MIN_VIEWS)
    kept, copies = without_copies(camera, kept)
    left_out += copies
    keys = list(kept)
    check_count(camera, len(keys), left_out)
    views = [board_view(board, kept[key], 0, number) for number, key in enumerate(keys)]
    outlier_pictures: list[LeftOut] = []
    found = fit_lens(size_px, views, USUAL_MODEL.free)
    for _ in range(OUTLIER_ROUNDS):
        errors_px = [rms(residual) for residual in found.residuals]
        bad = outliers(errors_px, size_px[0])
        if not bad:
            break
        median = np.median(errors_px)
        outlier_pictures += [
            LeftOut(
                camera,
                keys[k],
                f"its corners are {errors_px[k]:.1f} px off, the others' {median:.2f}",
            )
            for k in bad
        ]
        good = [k for k in range(len(keys)) if k not in bad]
        check_count(camera, len(good), outlier_pictures)
        keys = [keys[k] for k in good]
        views = [replace(views[k], board=number) for number, k in enumerate(good)]
        found = fit_lens(size_px, views, USUAL_MODEL.free)
    check_one_lens(camera, keys, size_px, views, found)
    return LensFit(camera, size_px, keys, views, found), [*left_out, *outlier_pictures]
