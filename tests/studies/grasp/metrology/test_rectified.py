"""Planes shown squarely; a rendered rectangle and a photographed chessboard measured."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from studies.grasp.metrology.lens import lens_from_edges
from studies.grasp.metrology.plane import plane_from_rectangle, plane_from_view
from studies.grasp.metrology.rectified import Rectified, raster_of
from studies.grasp.metrology.segments import segment_of
from studies.grasp.metrology.view import common_lens, view_from_edges
from studies.grasp.scene.backdrop import Rectangle, straight_lines
from studies.grasp.scene.experiment import Experiment, Options
from studies.grasp.scene.motion import Cycles
from studies.grasp.scene.subjects import SUBJECTS
from studies.grasp.scene.view import ViewOptions

BOARD = Path(os.environ.get("RHOT_DATA", "/nowhere")) / "stereo_chessboard"


def test_a_rendered_plane_is_shown_squarely_and_measured():
    """Lens from straight edges, plane from the card's rectangle with clicks that are 0.3 px off:
    joints' distances within 1 %.
    """
    options = Options(view=ViewOptions(tilt_deg=20.0), cycles=Cycles(1, 0.4, 10.0), dots="black")
    shown = Experiment(SUBJECTS[2], options, 5)
    rng = np.random.default_rng(1)
    lens = lens_from_edges(straight_lines(shown.view, Rectangle(), 5), (640, 480))
    corners = shown.view.pixels(Rectangle().corners) + rng.normal(0.0, 0.3, (4, 2))
    flat = lens.straightened(corners)
    plane = plane_from_rectangle(flat, (80.0, 36.0), 0.3)
    joints = shown.pixels_of(0)
    found = plane.to_mm(lens.straightened([joints[name] for name in ("mcp", "pip", "dip", "tip")]))
    lengths = np.hypot(*np.diff(found, axis=0).T)
    assert np.allclose(lengths, shown.subject.lengths, rtol=0.01)

    raster = raster_of(plane, (640, 480), flat)
    # As fine as the picture, and its whole width.
    assert 500 < raster.size_px[0] < 1500
    K, k = lens.matrix, lens.distortion

    def distort(px):
        from rhot.geometry.camera import distort as bend

        return bend((px - K[:2, 2]) / K[0, 0], k) * K[0, 0] + K[:2, 2]

    picture = Rectified(plane, raster, distort).picture(shown.picture(0))
    assert picture.shape[:2] == raster.size_px[::-1]
    # The frame's upper edge is level now: dark ink below, white card above.
    for x in (10.0, 40.0, 70.0):
        (xi, yo), (_, yi) = np.round(
            (np.array([(x, -2.0), (x, 2.0)]) - raster.corner_mm) * raster.px_per_mm
        ).astype(int)
        assert picture[yi, xi].mean() + 60 < picture[yo, xi].mean()


@pytest.mark.skipif(not BOARD.is_dir(), reason="needs RHOT_DATA with stereo_chessboard")
def test_a_photographed_boards_inner_corners_from_its_border_and_one_length():
    """Of three pictures: lens from all lines of the board, plane from its four border lines, scale
    from the upper border's length; distances of the 28 inner corners within 1 % (median), and with
    the focal length that all three agree on within .5 %.
    """
    boards = [_corners(BOARD / name) for name in ("left01.jpg", "left05.jpg", "left11.jpg")]
    lens = lens_from_edges(
        [line for board in boards for line in (*board, *board.transpose(1, 0, 2))], (640, 480)
    )
    assert lens.rms_px < 0.3 < lens.bend_px
    i, j = np.triu_indices(28, 1)
    inner = np.stack(np.meshgrid(np.arange(7), np.arange(4)), axis=-1).reshape(-1, 2)
    wanted = np.hypot(*(inner[i] - inner[j]).T)
    flat = [lens.straightened(board).reshape(6, 9, 2) for board in boards]
    edges = [
        (
            np.array([segment_of(one[0]), segment_of(one[-1])]),
            np.array([segment_of(one[:, 0]), segment_of(one[:, -1])]),
        )
        for one in flat
    ]
    alone = [view_from_edges(x, y, (640, 480), sigma_px=0.2) for x, y in edges]
    # The lens was calibrated with all 13 boards: 533 px.
    matrix = common_lens(alone, (640, 480))
    assert matrix[0, 0] == pytest.approx(533.0, rel=0.05)
    shared = [view_from_edges(x, y, (640, 480), sigma_px=0.2, matrix=matrix) for x, y in edges]
    for views, median, worst in ((alone, 0.01, 0.04), (shared, 0.005, 0.015)):
        for one, view in zip(flat, views, strict=True):
            plane = plane_from_view(view, one[0, 0], one[0, -1], 8 * 25.0, 0.2)
            mm = plane.to_mm(one[1:-1, 1:-1])
            off = np.abs(np.hypot(*(mm[i] - mm[j]).T) / (25.0 * wanted) - 1.0)
            assert np.median(off) < median
            assert off[wanted >= 3.0].max() < worst


def _corners(path):
    gray = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCorners(gray, (9, 6))
    assert found
    corners = np.ascontiguousarray(np.asarray(corners, np.float32).reshape(-1, 1, 2))
    fine = cv2.cornerSubPix(gray, corners, (5, 5), (-1, -1), (3, 50, 1e-4))
    return np.asarray(fine, float).reshape(6, 9, 2)
