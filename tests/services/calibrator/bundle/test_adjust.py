"""Bundle adjustment: honest sigmas, robustness, and what is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector, transform
from services.calibrator.board.board_views import board_view
from services.calibrator.bundle.adjust import FreeUnknowns, adjust
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import State
from services.calibrator.lens.model_selection import LENS_MODELS, USUAL_MODEL

BOTH_LENSES = np.tile(USUAL_MODEL.free, (2, 1))
LENS_ERROR = np.array([15.0, -12.0, 8.0, 5.0, 0.05, -0.05, 0.0, 0.0, 0.0])


def test_a_rig_is_found_again_within_its_sigmas(noisy_pair):
    """Test: start from a disturbed rig.

    Expected: lenses and extrinsics within four sigmas of the truth, chi squared near one.
    """
    _, views, true = noisy_pair
    camera_off = transform(rotation_from_vector([0.02, -0.03, 0.01]), [0.01, 0.01, 0.0])
    board_off = transform(rotation_from_vector([0.05, 0.0, -0.05]), [0.01, -0.01, 0.02])
    start = State(
        lenses=true.lenses + LENS_ERROR,
        T_camera_from_rig=np.stack(
            [true.T_camera_from_rig[0], camera_off @ true.T_camera_from_rig[1]]
        ),
        T_rig_from_board=np.stack([board_off @ T for T in true.T_rig_from_board]),
    )
    found = adjust(views, start, FreeUnknowns(BOTH_LENSES, np.array([False, True])))
    assert found.rms_px == pytest.approx(0.1 * np.sqrt(2.0), rel=0.06)
    free = found.lens_sigma > 0.0
    z = ((found.state.lenses - true.lenses) / np.where(free, found.lens_sigma, 1.0))[free]
    assert np.abs(z).max() < 4.0
    shift = found.state.T_camera_from_rig[1][:3, 3] - true.T_camera_from_rig[1][:3, 3]
    assert np.all(np.abs(shift) < 4.0 * found.extrinsics_sigma[1, 3:])
    assert np.linalg.norm(shift) < 5e-4


def test_wild_corners_hardly_move_the_result(noisy_pair):
    _, views, true = noisy_pair
    wild = np.where(np.arange(54)[:, None] == 10, 40.0, 0.0)
    spoilt = [replace(views[0], pixels=views[0].pixels + wild), *views[1:]]
    found = adjust(spoilt, true, FreeUnknowns(BOTH_LENSES, np.array([False, True])))
    shift = found.state.T_camera_from_rig[1][:3, 3] - true.T_camera_from_rig[1][:3, 3]
    assert np.linalg.norm(shift) < 1e-3


def test_what_is_held_does_not_move(noisy_pair):
    _, views, true = noisy_pair
    found = adjust(views, true, FreeUnknowns.boards_only(2))
    np.testing.assert_array_equal(found.state.lenses, true.lenses)
    np.testing.assert_array_equal(found.state.T_camera_from_rig, true.T_camera_from_rig)
    assert not np.any(found.lens_sigma)


def test_an_undetermined_number_has_a_large_sigma(make_bench):
    """Test: one camera's extrinsics are free although it sees no board with another.

    Expected: no crash, and a sigma that says so.
    """
    bench = make_bench(positions=5)
    found = bench.detections()["left"]
    views = [board_view(bench.board, detection, 0, k) for k, detection in enumerate(found.values())]
    lens = lens_vector(bench.cameras[0].matrix, bench.cameras[0].distortion)
    state = State(lens[None], np.eye(4)[None], np.stack([bench.poses[key] for key in found]))
    loose = adjust(views, state, FreeUnknowns(np.zeros((1, 9), dtype=bool), np.array([True])))
    held = adjust(views, state, FreeUnknowns.one_lens(LENS_MODELS[0].free))
    assert np.all(np.isfinite(loose.extrinsics_sigma))
    assert loose.rms_px == pytest.approx(held.rms_px, rel=0.05)
