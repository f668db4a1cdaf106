"""Cups are really grasped: skin touches, nothing slips or goes through, and beside is beside."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.errors import ConfigError
from rhot.files.calibration import load_hand
from rhot.files.capture import Capture
from rhot.hand_skin import PARTS
from services.simulator.files.capture_writer import write_capture
from services.simulator.hands.families import VARIED
from services.simulator.scene.grasp_scenes import grasp_scene
from services.simulator.scene.scene import load_scene


def contacts(scene, times) -> np.ndarray:
    """Distances of the parts (t, 6), metres."""
    rows = [scene.truth(float(t)).objects["cup"].contacts for t in times]
    return np.array([[row[f"right.{part}"] for part in PARTS] for row in rows])


def test_the_cup_is_taken_carried_and_put_back(config):
    scene = load_scene(config, "grab", seed=1)
    gaps = contacts(scene, [0.1, 3.9, 7.9])
    assert np.all(gaps[[0, 2]] > 0.02)
    np.testing.assert_allclose(gaps[1, :5], -1e-4, atol=2e-4)
    held = [scene.truth(float(t)).objects["cup"].held_by for t in (0.1, 3.9, 7.9)]
    assert held == ["", "right", ""]


@pytest.mark.parametrize("seed", [4, 9])
def test_nothing_slips_and_nothing_goes_through(config, seed):
    scene = grasp_scene(config, seed)
    carried = contacts(scene, np.arange(2.4, 5.4, 0.1))
    assert np.ptp(carried, axis=0).max() < 1e-5
    assert carried.min() > -1e-3
    # On the way there and back, skin that is about to touch may be pressed in a little.
    assert contacts(scene, np.arange(0.0, 8.0, 0.04)).min() > -2.5e-3


@pytest.mark.parametrize("seed", [4, 9])
def test_an_object_that_stands_does_not_move(config, seed):
    scene = grasp_scene(config, seed)
    times = [*np.arange(0.0, 2.3, 0.1), *np.arange(5.5, 8.0, 0.1)]
    poses = np.array([scene.object_poses(float(t))["cup"] for t in times])
    np.testing.assert_allclose(poses, np.broadcast_to(poses[0], poses.shape), atol=1e-9)
    fine = np.arange(2.0, 6.0, 0.002)
    moved = np.array([scene.object_poses(float(t))["cup"][:3, 3] for t in fine])
    assert np.linalg.norm(np.diff(moved, axis=0), axis=1).max() < 0.002 * 0.4


@pytest.mark.parametrize("seed", [2, 5])
def test_who_passes_by_keeps_away(config, seed):
    scene = grasp_scene(config, seed, touch=False)
    gaps = contacts(scene, np.arange(0.0, 8.0, 0.05))
    assert gaps.min() > 0.007
    assert gaps.min() < 0.0105
    assert all(scene.truth(t).objects["cup"].held_by == "" for t in (2.0, 4.0, 6.0))


def test_families_differ(config):
    sizes = [grasp_scene(config, seed).config.object[0].size_m for seed in (1, 2)]
    assert sizes[0] != sizes[1]
    with pytest.raises(ConfigError, match="object"):
        grasp_scene(msgspec.structs.replace(config, object=[]), 1)


def test_a_capture_of_a_family_has_its_hand_and_cup(config, tmp_path):
    scene = grasp_scene(config, 3)
    write_capture(scene, 0.2, tmp_path / "capture")
    capture = Capture(tmp_path / "capture")
    assert load_hand(capture.folder / "calibration", "right").origin == VARIED
    assert f"{scene.config.object[0].size_m[0]!r}" in capture.rig_toml.read_text()


def test_objects_without_a_shape_are_taken_as_before(config):
    plain = msgspec.structs.replace(
        config,
        object=[msgspec.structs.replace(config.object[0], shape="", size_m=(), marker=None)],
    )
    truth = load_scene(plain, "grab", seed=1).truth(4.0).objects["cup"]
    assert (truth.contacts, truth.held_by) == ({}, "")
