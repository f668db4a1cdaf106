"""A lens fitted from nothing but views of a board, beside OpenCV's calibration."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from services.calibrator.board.board_views import board_view
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.lens.fit import fit_lens
from services.calibrator.lens.model_selection import USUAL_MODEL


def test_one_lens_agrees_with_opencv(make_bench):
    bench = make_bench(positions=8)
    size_px = bench.cameras[0].size_px
    views = [
        board_view(bench.board, detection, 0, k)
        for k, detection in enumerate(bench.detections(noise_px=0.1)["left"].values())
    ]
    ours = fit_lens(size_px, views, USUAL_MODEL.free)
    error, matrix, distortion, _, _ = cv2.calibrateCamera(
        [view.points.astype(np.float32) for view in views],
        [view.pixels.astype(np.float32) for view in views],
        size_px,
        None,
        None,
        flags=cv2.CALIB_FIX_K3,
    )
    assert ours.rms_px == pytest.approx(error, abs=2e-3)
    theirs = lens_vector(matrix, distortion.reshape(-1))
    np.testing.assert_allclose(ours.state.lenses[0, :4], theirs[:4], atol=0.1)
