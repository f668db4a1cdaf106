"""The held-out board error: what noise makes of it, and when there is none."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.board.board_views import board_view
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import State
from services.calibrator.rig.held_out_error import held_out_error


def views_and_state(bench, noise_px):
    found = bench.detections(noise_px)
    key = next(
        key for key in bench.poses if all(key in found[camera.name] for camera in bench.cameras)
    )
    views = [
        board_view(bench.board, found[camera.name][key], k, 0)
        for k, camera in enumerate(bench.cameras)
    ]
    state = State(
        np.stack([lens_vector(camera.matrix, camera.distortion) for camera in bench.cameras]),
        np.stack([camera.T_camera_from_rig for camera in bench.cameras]),
        bench.poses[key][None],
    )
    return views, state, key


def test_a_true_rig_has_no_error(make_bench):
    bench = make_bench()
    views, state, key = views_and_state(bench, 0.0)
    error = held_out_error(views, state, bench.board)
    assert error is not None
    assert error.fit_squares < 1e-8
    assert error.square_ratio == pytest.approx(1.0, abs=1e-9)
    assert error.epipolar_px < 1e-6
    assert error.reprojection_px < 1e-4
    middle = bench.poses[key] @ np.append(bench.board.points.mean(axis=0), 1.0)
    assert error.distance_m == pytest.approx(np.linalg.norm(middle[:3]), rel=0.02)


def test_a_baseline_too_long_makes_squares_too_large(make_bench):
    bench = make_bench()
    views, state, _ = views_and_state(bench, 0.0)
    longer = state.T_camera_from_rig.copy()
    longer[1, :3, 3] *= 1.02
    error = held_out_error(views, State(state.lenses, longer, state.T_rig_from_board), bench.board)
    assert error is not None
    assert error.square_ratio == pytest.approx(1.02, abs=2e-3)


def test_one_view_or_too_few_common_corners_have_no_error(make_bench):
    bench = make_bench()
    views, state, _ = views_and_state(bench, 0.0)
    assert held_out_error(views[:1], state, bench.board) is None
    apart = [views[0], type(views[1])(1, 0, np.arange(5), views[1].points[:5], views[1].pixels[:5])]
    assert held_out_error(apart, state, bench.board) is None
