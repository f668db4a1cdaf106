"""Which pictures of a camera a lens is fitted to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.bundle.lens_model import lens_camera
from services.calibrator.lens.calibrate import calibrate_lens
from services.calibrator.lens.screening import fit_pictures

# k1, k2, p1, p2, k3 of lenses that need k3, and a focal length with which it shows at the edge.
STRONG = {
    "barrel": (-0.36, 0.2, 0.001, -0.0005, -0.06),
    "pincushion": (0.15, -0.5, 0.0, 0.0, 0.6),
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


def test_copies_of_a_picture_are_left_out_and_copies_alone_refused(make_bench):
    bench = make_bench(1, 6)
    (found,) = bench.detections(0.1).values()
    first, *_ = found
    copy = replace(found[first], corners=found[first].corners + 0.05)
    fit, left_out = fit_pictures("left", {**found, "copy": copy}, bench.board)
    assert [(item.key, item.reason) for item in left_out] == [
        ("copy", f"shows the board exactly where {first} does")
    ]
    assert fit.keys == list(found)
    generator = np.random.default_rng(3)
    nearly = {
        f"{k}.png": replace(copy, corners=copy.corners + generator.normal(0.0, 0.4, (54, 2)))
        for k in range(8)
    }
    with pytest.raises(CalibrationError, match="all 8 pictures show the board at the same place"):
        fit_pictures("left", nearly, bench.board)


def test_pictures_of_two_lenses_are_told_apart(make_bench):
    found = {}
    for name, focal_px, distortion in (
        ("a", 527.0, (-0.25, 0.08, 0.0, 0.0, 0.0)),
        ("b", 800.0, (-0.05, 0.01, 0.0, 0.0, 0.0)),
    ):
        bench = make_bench(1, 9, focal_px=focal_px, distortion=distortion)
        (own,) = bench.detections(0.1).values()
        found |= {f"{key}{name}.png": seen for key, seen in own.items()}
    with pytest.raises(CalibrationError, match="the pictures are of two lenses") as refused:
        fit_pictures("left", dict(sorted(found.items())), bench.board)
    assert "01a.png, 02a.png" in str(refused.value)


def test_no_picture_of_the_board_asks_for_its_corners(make_bench):
    with pytest.raises(CalibrationError, match=r"only 0 usable pictures.* is --board its"):
        fit_pictures("left", {}, make_bench(1, 1).board)


def test_a_wide_lens_is_given_the_fisheye_model_and_calibrated(make_bench):
    """140 degrees across: f 272 px, boards up to 70 degrees and more from the axis."""
    k = (-0.03, 0.006, -0.002, 0.0003)
    wide = {"focal_px": 272.0, "distortion": k, "spread": 1.6, "depth_m": (0.12, 0.3)}
    bench = make_bench(1, 45, **wide)
    (found,) = bench.detections(0.12).values()
    assert len(found) >= 8
    result = calibrate_lens("left", dict(list(found.items())[:10]), bench.board)
    assert result.model.startswith("fisheye")
    assert result.left_out == ()
    assert result.rms_px < 0.2
    assert result.held_out_px < 0.25
    camera = lens_camera("left", result.size_px, result.lens, np.eye(4))
    assert len(camera.distortion) == 4
    steep = np.tan(np.radians([30.0, 55.0, 70.0]))
    rays = np.stack([steep, -0.3 * steep], axis=1)
    truth = bench.cameras[0].pixels_from_rays(rays)
    np.testing.assert_allclose(camera.pixels_from_rays(rays), truth, atol=0.7)
