"""A lens fitted from nothing but views of a board, beside OpenCV's calibration."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from services.calibrator.board.board_views import board_view
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.lens.fit import fit_lens, fit_pictures
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


# k1, k2, p1, p2, k3 of lenses that need k3, and a focal length with which it shows at the edge.
STRONG = {
    "barrel": (-0.36, 0.2, 0.001, -0.0005, -0.06),
    "pincushion": (0.15, -0.5, 0.0, 0.0, 0.6),
    "moustache": (-0.3, 0.35, 0.0, 0.0, -0.2),
}


@pytest.mark.parametrize("name", STRONG)
def test_good_pictures_at_the_edge_are_kept_and_a_bad_one_is_not(make_bench, name):
    bench = make_bench(
        1, 120, focal_px=420.0, distortion=STRONG[name], spread=0.8, depth_m=(0.25, 0.5)
    )
    (found,) = bench.detections(0.12).values()
    found = dict(sorted(found.items(), key=lambda item: _edge_px(item[1])))
    found = {key: seen for k, (key, seen) in enumerate(found.items()) if k < 3 or k % 3 == 0}
    found = dict(list(found.items())[:16])
    at_edge = [key for key, seen in found.items() if _edge_px(seen) < 15.0]
    assert 2 <= len(at_edge) <= 6
    middle = next(key for key in reversed(found) if key not in at_edge)
    moved = found[middle].corners.copy()
    moved[:9] += 4.0
    found["bad"] = replace(found[middle], corners=moved)
    fit, left_out = fit_pictures("left", found, bench.board)
    assert [item.key for item in left_out] == ["bad"]
    assert fit.found.rms_px < 0.2


def _edge_px(seen):
    """How near the corners come to the edge of the picture."""
    return min(seen.corners.min(), (np.array(seen.size_px) - seen.corners).min())
