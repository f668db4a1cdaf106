"""The synthetic hand is what it says: every pixel is the truth at its own instant."""

from __future__ import annotations

import numpy as np
import pytest

from testing.synthetic_points import COLORS, START_NS, Path, Setup, frames


def test_every_marker_is_seen_at_its_own_instant():
    setup = Setup(sigma_px=0.0, clock_error_s=0.0, loss=0.0)
    path, cameras = Path(), setup.rig()
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
    path = Path(speed_m_s=0.4)
    instants = np.arange(0.0, 60.0, 1e-3)
    speed = np.linalg.norm(np.gradient(path(instants), 1e-3, axis=0), axis=2)
    assert np.sqrt(np.mean(speed**2)) == pytest.approx(0.4, rel=0.1)
    given = frames(Setup(loss=0.1), path, 20.0)
    assert len(given) == pytest.approx(0.9 * 1200, rel=0.05)
    left, right = (
        next(frame for frame in given if frame.camera == name) for name in ("left", "right")
    )
    assert left.clock_offset_ns == pytest.approx(20.5e6, abs=1e4)
    assert right.clock_offset_ns == pytest.approx(-20.5e6, abs=1e4)
    assert frames(Setup(), path, 1.0) == frames(Setup(), path, 1.0)
