"""Real motion as a scene: the truth is what the model does, and its points agree with it."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot.errors import ConfigError
from rhot.files.capture import write_lines
from rhot.files.config import RigConfig
from rhot.hand import BASIC_LANDMARKS
from services.simulator.recorded_motion.bones import DrivenHand
from services.simulator.recorded_motion.scenes import (
    MotionView,
    live_scene,
    load_motion,
    point_scene,
    recorded_scene,
)
from services.simulator.scene.actors import middle_of_cameras
from services.simulator.scene.scene import Scene, load_scene


def _points(scene: Scene, times: np.ndarray, hand: str = "right") -> np.ndarray:
    """Wrist and tips of the truth (n, 6, 3)."""
    truths = [scene.truth(float(t)).hands[hand].points_m for t in times]
    return np.array([[points[name] for name in BASIC_LANDMARKS] for points in truths])


@pytest.mark.parametrize("name", ["pinch", "HandSplay-110fps"])
def test_the_rendered_hand_moves_as_the_recorded_one(
    config: RigConfig, rhot_data: Path, name: str
) -> None:
    """Distances between tips are those of the recording, at its instants and at twice its speed."""
    driven = load_motion(rhot_data / f"hand_motion/leap/{name}.csv")
    assert isinstance(driven, DrivenHand)
    scene = recorded_scene(config, driven, MotionView(distance_m=0.6, speed=2.0))
    rows = np.arange(0, len(driven.times_s) - 30, 25)
    points = _points(scene, driven.times_s[rows] / 2.0)
    for landmark in range(6):
        for other in range(landmark):
            np.testing.assert_allclose(
                np.linalg.norm(points[:, landmark] - points[:, other], axis=1),
                np.linalg.norm(
                    driven.points().points_m[rows, landmark]
                    - driven.points().points_m[rows, other],
                    axis=1,
                ),
                atol=5e-6,
            )
    times = np.arange(0.0, driven.times_s[-1] / 2.0, 0.02)
    middle = middle_of_cameras(list(scene.cameras.values())) + np.array([0.0, 0.0, 0.6])
    np.testing.assert_allclose(_points(scene, times).mean(axis=(0, 1)), middle, atol=0.02)
    # Palm and cameras face each other.
    assert scene.hands["right"].placement.rotation[2, 1] > 0.8


def test_points_alone_are_the_rendered_hands(config: RigConfig, rhot_data: Path) -> None:
    driven = load_motion(rhot_data / "hand_motion/leap/pinch.csv")
    assert isinstance(driven, DrivenHand)
    view = MotionView(seconds=9.0, seed=3)
    times = np.arange(0.0, 9.0, 0.07)
    scene, points = recorded_scene(config, driven, view), point_scene(config, driven, view)
    np.testing.assert_allclose(points.motion(times), _points(scene, times), atol=2e-5)
    own_times = np.tile(times[:, None], (1, 6))
    own_times[:, 3] += 0.01
    shifted = points.motion(own_times)
    np.testing.assert_array_equal(shifted[:, 2], points.motion(times)[:, 2])
    np.testing.assert_array_equal(shifted[:, 3], points.motion(times + 0.01)[:, 3])


def test_a_simulated_truth_moves_a_hand_in_the_same_way(config: RigConfig, tmp_path: Path) -> None:
    """Angles and bones of truth.jsonl come back, to what its numbers are rounded to."""
    original = load_scene(config, "random", seed=3)
    times = np.arange(0.0, 1.5, 1.0 / 60.0)
    path = tmp_path / "truth.jsonl"
    write_lines(path, (original.truth(float(t)) for t in times))
    driven = load_motion(path)
    assert isinstance(driven, DrivenHand)
    scene = recorded_scene(config, driven, MotionView(seconds=1.4))
    for t in (0.0, 0.25, 0.904):
        expected = original.hands["right"].state_at(t)
        found = scene.hands["right"].state_at(t)
        np.testing.assert_allclose(found.angles_rad, expected.angles_rad, atol=3e-5)
    bones = original.hands["right"].model.lengths_m
    np.testing.assert_allclose(driven.model.lengths_m, bones, atol=1e-6)


def test_a_left_hand_takes_over_the_paint(config: RigConfig, tmp_path: Path) -> None:
    left = msgspec.structs.replace(config, hand={"left": config.hand["right"]})
    path = tmp_path / "truth.jsonl"
    original = load_scene(left, "piano", seed=1)
    write_lines(path, (original.truth(float(t)) for t in np.arange(0.0, 1.0, 0.02)))
    driven = load_motion(path)
    assert isinstance(driven, DrivenHand)
    scene = recorded_scene(config, driven, MotionView())
    assert set(scene.hands) == {"left"}
    assert scene.hands["left"].landmarks == config.hand["right"].markers
    with pytest.raises(ConfigError, match="needs a hand"):
        recorded_scene(msgspec.structs.replace(config, hand={}), driven, MotionView())


def test_a_live_scene_is_the_recording_that_rig_toml_names(
    config: RigConfig, rhot_data: Path
) -> None:
    settings = msgspec.structs.replace(
        config.simulator,
        motion=str(rhot_data / "hand_motion/leap/wave.csv"),
        motion_distance_m=0.4,
    )
    scene = live_scene(msgspec.structs.replace(config, simulator=settings))
    assert scene.name == "recorded"
    # It goes on for ever, and stays where it is.
    points = _points(scene, np.arange(100.0, 102.0, 0.05))
    assert points[..., 2].mean() == pytest.approx(0.4, abs=0.03)
    assert np.ptp(points[:, 3, 0]) > 0.05
    assert live_scene(config).name == config.simulator.scene
    glove = msgspec.structs.replace(
        settings, motion=str(rhot_data / "hand_motion/qualisys/recording.tsv.gz")
    )
    with pytest.raises(ConfigError, match="nothing to render live"):
        live_scene(msgspec.structs.replace(config, simulator=glove))
