"""Noisy views of two cameras, as the bundle adjustment gets them."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.board.board_views import board_view
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import State, View
from testing.synthetic_boards import Bench, BenchSetup


@pytest.fixture(scope="session")
def noisy_pair() -> tuple[Bench, list[View], State]:
    """A bench, its views of boards both cameras see with .1 px of noise, and the true state."""
    bench = BenchSetup(positions=8).bench()
    found = bench.detections(noise_px=0.1)
    keys = [
        key for key in bench.poses if all(key in found[camera.name] for camera in bench.cameras)
    ]
    views = [
        board_view(bench.board, found[camera.name][key], c, k)
        for c, camera in enumerate(bench.cameras)
        for k, key in enumerate(keys)
    ]
    state = State(
        lenses=np.stack([lens_vector(each.matrix, each.distortion) for each in bench.cameras]),
        T_camera_from_rig=np.stack([camera.T_camera_from_rig for camera in bench.cameras]),
        T_rig_from_board=np.stack([bench.poses[key] for key in keys]),
    )
    return bench, views, state
