"""The synthetic hand is what it says: every pixel is the truth at its own instant."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.calibration import load_rig_cameras
from testing.synthetic_points import COLORS, START_NS, MovingHand, SyntheticRig, frames


def test_every_marker_is_seen_at_its_own_instant():
    setup = SyntheticRig(sigma_px=0.0, clock_error_s=0.0, loss=0.0)
    path, cameras = MovingHand(), setup.rig()
    for frame in frames(setup, path, 0.5):
        for marker in frame.markers:
            instant_s = (
                frame.stamp_ns - frame.clock_offset_ns - START_NS + marker.y_px * frame.row_time_ns
            ) * 1e-9
            place = path(np.array([instant_s]))[0, COLORS.index(marker.color)]
            np.testing.assert_allclose(
                cameras[frame.camera].project(place)[0], [marker.x_px, marker.y_px], atol=2e-3
            )


def test_speed_noise_loss_and_clocks_are_as_asked():
    path = MovingHand(speed_m_s=0.4)
    instants = np.arange(0.0, 60.0, 1e-3)
    speed = np.linalg.norm(np.gradient(path(instants), 1e-3, axis=0), axis=2)
    assert np.sqrt(np.mean(speed**2)) == pytest.approx(0.4, rel=0.1)
    given = frames(SyntheticRig(loss=0.1), path, 20.0)
    assert len(given) == pytest.approx(0.9 * 1200, rel=0.05)
    left, right = (
        next(frame for frame in given if frame.camera == name) for name in ("left", "right")
    )
    assert left.clock_offset_ns == pytest.approx(20.5e6, abs=1e4)
    assert right.clock_offset_ns == pytest.approx(-20.5e6, abs=1e4)
    assert frames(SyntheticRig(), path, 1.0) == frames(SyntheticRig(), path, 1.0)


def test_the_calibration_on_disk_is_that_of_the_rig(tmp_path):
    setup = SyntheticRig(cameras=3, toe_in_rad=0.1)
    setup.save_calibration(tmp_path / "calibration")
    config = msgspec.structs.replace(setup.config(), folder=str(tmp_path))
    loaded = load_rig_cameras(config)
    assert list(loaded) == list(setup.names)
    for name, camera in setup.rig().items():
        np.testing.assert_array_equal(loaded[name].matrix, camera.matrix)
        np.testing.assert_array_equal(loaded[name].distortion, camera.distortion)
        np.testing.assert_array_equal(loaded[name].T_rig_from_camera, camera.T_rig_from_camera)
