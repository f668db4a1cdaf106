"""Markers without pictures: where cameras see the points of a real glove, each at its own row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.hand import BASIC_LANDMARKS
from services.fusion.step import FusionStep
from services.simulator.camera.marker_source import marker_frames, point_truth
from services.simulator.recorded_motion.recording import RecordedPoints
from services.simulator.recorded_motion.scenes import (
    MotionView,
    PointScene,
    load_motion,
    point_scene,
)
from testing.synthetic_points import START_NS, point_hands

SECONDS = 4.0


@pytest.fixture(scope="module")
def glove(config: RigConfig, rhot_data: Path) -> PointScene:
    recorded = load_motion(rhot_data / "hand_motion/qualisys/recording.tsv.gz")
    return point_scene(config, recorded, MotionView(seconds=SECONDS, distance_m=0.7))


def test_each_marker_is_seen_at_its_own_instant(glove: PointScene) -> None:
    frames = marker_frames(glove, SECONDS, START_NS)
    assert {frame.camera for frame in frames} == {"left", "right"}
    assert 0.95 * 240 < len(frames) < 240
    gaps = []
    for frame in frames:
        camera = glove.cameras[frame.camera]
        for marker in frame.markers:
            instant_ns = frame.stamp_ns - START_NS + marker.y_px * frame.row_time_ns
            landmark = glove.colors.index(marker.color)
            point = glove.motion(np.array([instant_ns * 1e-9]))[0, landmark]
            gaps.append(camera.project(point[None])[0] - (marker.x_px, marker.y_px))
            assert 0.0 <= marker.x_px <= 639.0
            assert 0.0 <= marker.y_px <= 479.0
    # The noise of centroids, and what the stamps' residual error of up to 0.4 ms makes of motion.
    assert np.std(gaps) == pytest.approx(0.06, abs=0.015)


def test_hidden_points_and_those_outside_the_picture_have_no_marker(glove: PointScene) -> None:
    near = point_scene(glove.config, _first_second(glove), MotionView(seconds=1.0, distance_m=0.15))
    frames = marker_frames(near, 1.0, START_NS)
    seen = np.mean([len(frame.markers) for frame in frames])
    assert 0.5 < seen < 5.5


def _first_second(scene: PointScene) -> RecordedPoints:
    """The glove's first second, whose thumb cannot be seen for most of it."""
    times = np.arange(0.0, 1.0, 0.01)
    points = scene.motion(times)
    points[20:80, 1] = np.nan
    return RecordedPoints("right", times, points)


def test_fusion_finds_the_glove_in_them(glove: PointScene) -> None:
    step = FusionStep(glove.config, glove.cameras, point_hands())
    errors = []
    for frame in marker_frames(glove, SECONDS, START_NS):
        for message in step.step(frame):
            truth = glove.motion(np.array([(message.stamp_ns - START_NS) * 1e-9]))[0]
            errors += [
                np.subtract(point.position_m, truth[BASIC_LANDMARKS.index(point.name)])
                for point in message.points
            ]
    assert len(errors) > 500
    assert np.median(np.linalg.norm(errors, axis=1)) < 2e-3
    lines = list(point_truth(glove, SECONDS, START_NS))
    assert len(lines) == 120
    np.testing.assert_allclose(
        lines[60].points[2].position_m,
        glove.motion(np.array([(lines[60].stamp_ns - START_NS) * 1e-9]))[0, 2],
        atol=1e-5,
    )
