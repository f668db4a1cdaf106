"""Bundle adjustment: derivatives, agreement with OpenCV, honest sigmas, robustness."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector, transform
from services.calibrator.bundle.adjust import Free, adjust
from services.calibrator.bundle.initial_guess import calibrate_lens
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import State, derivatives, pixel_errors
from services.calibrator.bundle.views import alone, view_of
from services.calibrator.lens.model_selection import MODELS, USUAL


@pytest.fixture(scope="module")
def pair(make_bench):
    """Views of two cameras with .1 px of noise, and the true state."""
    bench = make_bench(positions=8)
    found = bench.detections(noise_px=0.1)
    keys = [
        key for key in bench.poses if all(key in found[camera.name] for camera in bench.cameras)
    ]
    views = [
        view_of(bench.board, found[camera.name][key], c, k)
        for c, camera in enumerate(bench.cameras)
        for k, key in enumerate(keys)
    ]
    state = State(
        np.stack([lens_vector(camera.matrix, camera.distortion) for camera in bench.cameras]),
        np.stack([camera.T_camera_from_rig for camera in bench.cameras]),
        np.stack([bench.poses[key] for key in keys]),
    )
    return bench, views, state


def test_derivatives_agree_with_finite_differences(pair):
    _, views, state = pair
    view = next(view for view in views if view.camera == 1)
    _, J = derivatives([view], state)
    h = 1e-6
    for column in range(21):

        def moved(sign: float, column: int = column) -> State:
            lenses, places, boards = (
                state.lenses.copy(),
                state.T_camera_from_rig.copy(),
                state.T_rig_from_board.copy(),
            )
            if column < 9:
                lenses[1, column] += sign * h
            else:
                which, axis = (places, column - 9) if column < 15 else (boards, column - 15)
                number = 1 if column < 15 else view.board
                step = np.zeros(6)
                step[axis] = sign * h
                T = which[number]
                which[number] = transform(
                    rotation_from_vector(step[:3]) @ T[:3, :3], T[:3, 3] + step[3:]
                )
            return State(lenses, places, boards)

        numeric = -(pixel_errors([view], moved(1.0))[0] - pixel_errors([view], moved(-1.0))[0]) / (
            2 * h
        )
        np.testing.assert_allclose(J[:, :, column], numeric, rtol=1e-5, atol=1e-3)


def test_one_lens_agrees_with_opencv(pair):
    bench, views, _ = pair
    mine = [
        replace(alone(view), board=k)
        for k, view in enumerate(view for view in views if view.camera == 0)
    ]
    ours = calibrate_lens(bench.cameras[0].size_px, mine, USUAL.free)
    error, matrix, distortion, _, _ = cv2.calibrateCamera(
        [view.points.astype(np.float32) for view in mine],
        [view.pixels.astype(np.float32) for view in mine],
        bench.cameras[0].size_px,
        None,
        None,
        flags=cv2.CALIB_FIX_K3,
    )
    assert ours.rms_px == pytest.approx(error, abs=2e-3)
    np.testing.assert_allclose(
        ours.state.lenses[0, :4], lens_vector(matrix, distortion.reshape(-1))[:4], atol=0.1
    )


def test_a_rig_is_found_again_within_its_sigmas(pair):
    """Test: start from a disturbed rig.

    Expected: lens and place numbers within four sigmas of the truth, chi squared near one.
    """
    bench, views, true = pair
    start = State(
        true.lenses + np.array([15.0, -12.0, 8.0, 5.0, 0.05, -0.05, 0.0, 0.0, 0.0]),
        np.stack(
            [
                true.T_camera_from_rig[0],
                transform(rotation_from_vector([0.02, -0.03, 0.01]), [0.01, 0.01, 0.0])
                @ true.T_camera_from_rig[1],
            ]
        ),
        np.stack(
            [
                transform(rotation_from_vector([0.05, 0.0, -0.05]), [0.01, -0.01, 0.02]) @ T
                for T in true.T_rig_from_board
            ]
        ),
    )
    found = adjust(views, start, Free(np.tile(USUAL.free, (2, 1)), np.array([False, True])))
    assert found.rms_px == pytest.approx(0.1 * np.sqrt(2.0), rel=0.06)
    free = found.lens_sigma > 0.0
    z = ((found.state.lenses - true.lenses) / np.where(free, found.lens_sigma, 1.0))[free]
    assert np.abs(z).max() < 4.0
    shift = found.state.T_camera_from_rig[1][:3, 3] - true.T_camera_from_rig[1][:3, 3]
    assert np.all(np.abs(shift) < 4.0 * found.place_sigma[1, 3:])
    assert np.linalg.norm(shift) < 5e-4
    assert bench.cameras[0].name == "left"


def test_wild_corners_hardly_move_the_result(pair):
    _, views, true = pair
    free = Free(np.tile(USUAL.free, (2, 1)), np.array([False, True]))
    spoilt = [
        replace(
            views[0], pixels=views[0].pixels + np.where(np.arange(54)[:, None] == 10, 40.0, 0.0)
        ),
        *views[1:],
    ]
    moved = (
        adjust(spoilt, true, free).state.T_camera_from_rig[1][:3, 3]
        - true.T_camera_from_rig[1][:3, 3]
    )
    assert np.linalg.norm(moved) < 1e-3


def test_what_is_held_does_not_move(pair):
    _, views, true = pair
    found = adjust(views, true, Free(np.zeros((2, 9), dtype=bool), np.zeros(2, dtype=bool)))
    np.testing.assert_array_equal(found.state.lenses, true.lenses)
    np.testing.assert_array_equal(found.state.T_camera_from_rig, true.T_camera_from_rig)
    assert not np.any(found.lens_sigma)


def test_an_undetermined_number_has_a_large_sigma(make_bench):
    """Test: one camera's place is free although it sees no board with another.

    Expected: no crash, and a sigma that says so.
    """
    bench = make_bench(positions=5)
    found = bench.detections()["left"]
    views = [view_of(bench.board, detection, 0, k) for k, detection in enumerate(found.values())]
    lens = lens_vector(bench.cameras[0].matrix, bench.cameras[0].distortion)
    state = State(lens[None], np.eye(4)[None], np.stack([bench.poses[key] for key in found]))
    loose = adjust(views, state, Free(np.zeros((1, 9), dtype=bool), np.array([True])))
    held = adjust(views, state, Free(MODELS[0].free[None], np.array([False])))
    assert np.all(np.isfinite(loose.place_sigma))
    assert loose.rms_px == pytest.approx(held.rms_px, rel=0.05)
