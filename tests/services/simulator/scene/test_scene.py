"""Scenes: named, repeatable, complete, and with the hand where the cameras see it."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError, ConfigError
from rhot.files.rig_tables import CameraTable, HandTable, ObjectTable, World
from rhot.files.simulator_table import Simulator
from rhot.geometry.transforms import angle_between, apply, rotation_x, transform
from rhot.hand import TIPS
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import load_scene
from services.simulator.scene.scene_shapes import scene_shapes


@pytest.mark.parametrize("name", SCENES)
def test_the_hand_stays_in_all_pictures(config, name):
    scene = load_scene(config, name, seed=2)
    for t_s in np.arange(0.0, 8.0, 0.15):
        for hand, state in scene.hand_states(float(t_s)).items():
            positions, _ = scene.hands[hand].joints(state)
            for camera in scene.cameras.values():
                pixels = camera.project(positions)
                assert np.all(pixels > 8.0), (t_s, hand, camera.name)
                assert np.all(pixels < np.array(camera.size_px) - 9.0), (t_s, hand, camera.name)


@pytest.mark.parametrize("name", [n for n in SCENES if n != "hard"])
def test_the_hand_is_half_a_metre_away_and_shows_its_palm(config, name):
    scene = load_scene(config, name, seed=3)
    for t_s in np.arange(0.0, 4.0, 0.5):
        for hand, state in scene.hand_states(float(t_s)).items():
            middle = scene.hands[hand].joints(state)[0].mean(axis=0)
            assert 0.40 < middle[2] < 0.60
            # The back of the hand (+y of the wrist) points away from the cameras.
            assert state.wrist_rotation[2, 1] > 0.3


def test_the_same_again_and_another(config):
    one, same, other = (load_scene(config, "random", seed=seed) for seed in (1, 1, 2))
    for t_s in (0.0, 1.234, 5000.0):
        np.testing.assert_array_equal(
            one.body_frames(t_s).positions, same.body_frames(t_s).positions
        )
        assert (
            np.abs(one.body_frames(t_s).positions - other.body_frames(t_s).positions).max() > 1e-3
        )


def test_defaults_come_from_rig_toml(config):
    own = msgspec.structs.replace(config, simulator=Simulator(scene="wave", seed=7, speed=2.0))
    scene = load_scene(own)
    assert (scene.name, scene.seed) == ("wave", 7)
    reference = load_scene(config, "wave", seed=7, speed=1.0)
    a = scene.hands["right"].motion(scene.hands["right"].speed * 1.0).turn_rad
    b = reference.hands["right"].motion(reference.hands["right"].speed * 2.0).turn_rad
    np.testing.assert_allclose(a, b)


def test_speed_moves_faster_and_tremor_does_not(config):
    slow, fast = (
        load_scene(config, "wave", seed=1, speed=speed).hands["right"] for speed in (0.5, 2.0)
    )
    np.testing.assert_array_equal(slow.involuntary(1.0)[1], fast.involuntary(1.0)[1])
    np.testing.assert_allclose(slow.motion(0.5 * 4.0).turn_rad, fast.motion(2.0 * 1.0).turn_rad)


def test_unknown_names_are_told_the_valid_ones(config):
    with pytest.raises(ConfigError, match=r"did you mean 'piano'.*still"):
        load_scene(config, "pianno")
    wrong = msgspec.structs.replace(
        config, hand={"right": HandTable(markers={"index_tip": "mauve"})}
    )
    with pytest.raises(ConfigError, match=r"no paint 'mauve'.*magenta"):
        scene_shapes(load_scene(wrong, "still"))


def test_what_is_missing_is_named(config, tmp_path):
    with pytest.raises(ConfigError, match="hand"):
        load_scene(msgspec.structs.replace(config, hand={}), "still")
    with pytest.raises(ConfigError, match="camera"):
        load_scene(msgspec.structs.replace(config, camera=[]), "still")
    with pytest.raises(CalibrationError, match=r"rig\.json"):
        load_scene(msgspec.structs.replace(config, folder=str(tmp_path)), "still")
    bigger = [CameraTable(name="left", source="simulator", size_px=(1280, 960))]
    with pytest.raises(CalibrationError, match="size_px"):
        load_scene(msgspec.structs.replace(config, camera=bigger), "still")


def test_an_object_is_taken_without_a_jump_and_then_rides_along(config):
    scene = load_scene(config, "grab", seed=1)
    times = np.arange(0.0, 8.0, 0.005)
    poses = np.array([scene.object_poses(float(t))["cup"] for t in times])
    assert (
        np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).max() < 0.005 * 0.35
    )  # under 0.35 m/s, no jump
    assert np.ptp(poses[:, :3, 3], axis=0).max() > 0.05
    held = [t for t in times if scene.hand_states(float(t))["right"].grip == 1.0]
    assert held[-1] - held[0] > 3.0
    relative = []
    for t in held[:: len(held) // 10]:
        state = scene.hand_states(float(t))["right"]
        relative.append(np.linalg.inv(state.T_rig_from_wrist) @ scene.object_poses(float(t))["cup"])
    np.testing.assert_allclose(
        relative, np.broadcast_to(relative[0], np.shape(relative)), atol=1e-9
    )
    np.testing.assert_array_equal(poses[0], poses[20])  # and rests before


def test_left_hands_mirror(config):
    left = msgspec.structs.replace(config, hand={"left": config.hand["right"]})
    scene = load_scene(left, "still", seed=1)
    positions, _ = scene.hands["left"].joints(scene.hand_states(0.0)["left"])
    right = load_scene(config, "still", seed=1)
    mirrored, _ = right.hands["right"].joints(right.hand_states(0.0)["right"])
    thumb, little = 5, 25
    assert positions[thumb, 0] < positions[little, 0]
    assert mirrored[thumb, 0] > mirrored[little, 0]


def test_two_hands_and_their_truth(config):
    scene = load_scene(config, "two_hands")
    truth = scene.truth(1.0, stamp_ns=5)
    assert truth.stamp_ns == 5
    assert set(truth.hands) == {"left", "right"}
    assert set(TIPS) <= set(truth.hands["left"].points_m)
    assert scene.hands["left"].landmarks == {}
    apart = np.array(truth.hands["left"].wrist.position_m) - np.array(
        truth.hands["right"].wrist.position_m
    )
    assert apart[0] > 0.15


def test_the_world_frame_moves_everything_together(config):
    T = transform(rotation_x(0.7), (0.1, -0.2, 0.3))
    rows = tuple(tuple(float(v) for v in row) for row in T)
    rig = msgspec.structs.replace(config.rig, world=World(T_rig_from_camera=rows))
    plain = load_scene(config, "piano", seed=1)
    turned = load_scene(msgspec.structs.replace(config, rig=rig), "piano", seed=1)
    a, b = plain.body_frames(2.0), turned.body_frames(2.0)
    np.testing.assert_allclose(b.positions, apply(T, a.positions), atol=1e-9)
    for name, camera in turned.cameras.items():
        np.testing.assert_allclose(
            camera.project(b.positions), plain.cameras[name].project(a.positions), atol=1e-6
        )


def test_more_objects_stand_in_a_row(config):
    tables = [ObjectTable(name=name, serial=f"LHR-{name}") for name in ("cup", "pen", "box")]
    scene = load_scene(msgspec.structs.replace(config, object=tables), "grab")
    assert [item.holder for item in scene.objects] == ["right", None, None]
    poses = scene.object_poses(4.0)
    assert np.linalg.norm(poses["pen"][:3, 3] - poses["box"][:3, 3]) > 0.05
    assert angle_between(poses["pen"][:3, :3], poses["box"][:3, :3]) < 1e-6
