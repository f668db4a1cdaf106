"""An object on its way through the volume: wide, turned, smooth, its bead in view."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.errors import ConfigError
from rhot.geometry.transforms import apply, vector_from_rotation
from services.simulator.render.renderer import Renderer
from services.simulator.scene.scene import load_scene
from services.simulator.scene.tracker_mounts import bead_m

TIMES = np.arange(0.0, 20.0, 0.1)


def beads(scene) -> np.ndarray:
    """Of the first object, in the rig frame; (n, 3)."""
    item = scene.objects[0]
    lever = item.T_object_from_tracker
    return np.array(
        [apply(item.pose_at(float(t), {}) @ lever, bead_m(item.place)) for t in TIMES]
    ).reshape(-1, 3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_bead_passes_through_the_volume_and_stays_in_all_pictures(config, seed):
    scene = load_scene(config, "registration", seed=seed)
    found = beads(scene)
    assert np.all(np.ptp(found, axis=0) > (0.3, 0.2, 0.35))
    for camera in scene.cameras.values():
        pixels = camera.project(found)
        assert np.all(pixels > 12.0)
        assert np.all(pixels < np.array(camera.size_px) - 13.0)


def test_it_turns_about_every_axis(config):
    item = load_scene(config, "registration").objects[0]
    start = item.pose_at(0.0, {})[:3, :3]
    turns = np.array(
        [vector_from_rotation(start.T @ item.pose_at(float(t), {})[:3, :3]) for t in TIMES]
    )
    assert np.all(np.rad2deg(np.ptp(turns, axis=0)) > 70.0)


def test_cameras_see_the_bead_most_of_the_time(config):
    scene = load_scene(config, "registration", seed=5)
    for name in scene.cameras:
        renderer = Renderer(scene, name)
        surface = 1 + renderer.shapes.marker_surfaces["cup"]
        areas = [np.count_nonzero(renderer.labels(float(t)) == surface) for t in TIMES[::8]]
        # 12 px is the least that the tracker takes for a marker.
        assert np.mean(np.array(areas) > 40) > 0.9
        assert np.median(areas) > 150


def test_second_derivatives_are_continuous(config):
    item = load_scene(config, "registration").objects[0]

    def jumps(step_s: float) -> float:
        poses = np.array(
            [item.pose_at(float(t), {})[:3].ravel() for t in np.arange(0.0, 6.0, step_s)]
        )
        return float(np.abs(np.diff(np.diff(poses, 2, axis=0) / step_s**2, axis=0)).max())

    assert jumps(2e-3) < 0.5 * jumps(8e-3)


def test_bad_variants_lack_what_they_say(config):
    unturned = load_scene(config, "registration_unturned").objects[0]
    rotations = [unturned.pose_at(float(t), {})[:3, :3] for t in TIMES]
    np.testing.assert_allclose(rotations, np.broadcast_to(rotations[0], (len(TIMES), 3, 3)))
    flat = load_scene(config, "registration_flat")
    assert np.ptp(beads(flat)[:, 2]) < 1e-9
    assert np.ptp(beads(flat)[:, 0]) > 0.3


def test_without_an_object_the_scene_says_what_it_needs(config):
    with pytest.raises(ConfigError, match=r"\[\[object\]\]"):
        load_scene(msgspec.structs.replace(config, object=[]), "registration")


def test_the_truth_has_the_object_and_no_hands(config):
    truth = load_scene(config, "registration").truth(3.0)
    assert truth.hands == {}
    assert set(truth.objects) == {"cup"}
