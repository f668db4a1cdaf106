"""Simulated Vive trackers: OpenVR's shape, the lighthouse frame, believable noise."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.calibration import load_objects
from rhot.geometry.transforms import angle_between, rotation_from_quaternion, transform
from services.simulator.scene.scene import load_scene
from services.simulator.scene.vive_trackers import tracker_pose


def poses(scene, times, first_seq=0):
    return [
        tracker_pose(scene, scene.objects[0], 1, float(t), first_seq + k, 1000 + k)
        for k, t in enumerate(times)
    ]


def matrix(pose) -> np.ndarray:
    return np.vstack([np.array(pose.mDeviceToAbsoluteTracking), (0.0, 0.0, 0.0, 1.0)])


def test_the_objects_pose_follows_from_the_trackers(config):
    scene = load_scene(config, "piano")
    truth = scene.object_poses(0.0)["cup"]
    objects = load_objects(config.calibration_dir)
    place = objects.objects["cup"]
    T_tracker_from_object = transform(
        rotation_from_quaternion(place.orientation_wxyz), place.offset_m
    )
    seen = [
        np.array(objects.T_rig_from_lighthouse) @ matrix(p) @ T_tracker_from_object
        for p in poses(scene, np.zeros(400))
    ]
    off_m = np.array([T[:3, 3] for T in seen]) - truth[:3, 3]
    turns = [angle_between(T[:3, :3], truth[:3, :3]) for T in seen]
    np.testing.assert_allclose(off_m.mean(axis=0), 0.0, atol=2e-4)
    # 1 mm of the tracker, and 0.3 deg over the lever of 75 mm.
    assert 0.8e-3 < np.sqrt(np.mean(np.sum(off_m**2, axis=1))) < 1.3e-3
    assert np.rad2deg(np.sqrt(np.mean(np.square(turns)))) == pytest.approx(0.3, rel=0.15)


def test_valves_fields(config):
    scene = load_scene(config, "piano")
    (pose,) = poses(scene, [1.0])
    assert (pose.v, pose.eTrackingResult, pose.bPoseIsValid, pose.bDeviceIsConnected) == (
        1,
        200,
        True,
        True,
    )
    assert pose.device.serial == "LHR-SIM00001"
    assert pose.device.device_class == "GenericTracker"
    assert (pose.seq, pose.stamp_ns) == (0, 1000)
    rotation = matrix(pose)[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-5)
    # The lighthouse frame has y up; a camera's y points down.
    assert np.array(load_objects(config.calibration_dir).T_rig_from_lighthouse)[1, 1] < -0.9


def test_velocities_are_those_of_the_motion(config):
    scene = load_scene(config, "grab")
    times = np.arange(2.5, 5.5, 0.05)
    seen = poses(scene, times)
    for pose, t in zip(seen[::10], times[::10], strict=True):
        before, after = (scene.object_poses(float(t) + s)["cup"] for s in (-0.01, 0.01))
        lever = scene.objects[0].T_object_from_tracker
        v_rig = ((after @ lever)[:3, 3] - (before @ lever)[:3, 3]) / 0.02
        v_lighthouse = scene.T_rig_from_lighthouse[:3, :3].T @ v_rig
        np.testing.assert_allclose(pose.vVelocity, v_lighthouse, atol=0.03)
    assert max(np.linalg.norm(p.vVelocity) for p in seen) > 0.05
    assert max(np.linalg.norm(p.vAngularVelocity) for p in seen) > 0.1


def test_deterministic(config):
    scene = load_scene(config, "grab")
    assert poses(scene, [1.0, 2.0]) == poses(scene, [1.0, 2.0])
    assert (
        poses(scene, [1.0])[0].mDeviceToAbsoluteTracking
        != poses(scene, [1.0], first_seq=1)[0].mDeviceToAbsoluteTracking
    )


def faulty(config, **settings):
    own = msgspec.structs.replace(
        config, simulator=msgspec.structs.replace(config.simulator, **settings)
    )
    return load_scene(own, "piano", seed=1)


def off_m(scene, times) -> np.ndarray:
    """Distances of the reported positions from a scene without any noise, metres."""
    exact = faulty(scene.config, tracker_noise_m=0.0, tracker_noise_deg=0.0, tracker_outliers=0.0)
    seen = [matrix(p)[:3, 3] for p in poses(scene, times)]
    return np.linalg.norm(np.array(seen) - [matrix(p)[:3, 3] for p in poses(exact, times)], axis=1)


def test_noise_and_outliers_are_as_asked_for(config):
    scene = faulty(config, tracker_noise_m=0.003, tracker_outliers=0.1)
    off = off_m(scene, np.zeros(600))
    assert np.mean(off > 0.019) == pytest.approx(0.1, abs=0.04)
    assert off.max() < 0.21
    assert np.sqrt(np.mean(np.square(off[off < 0.015]))) == pytest.approx(0.003, rel=0.1)


def test_drop_outs_are_told_and_keep_the_last_pose(config):
    scene = faulty(config, tracker_dropouts=0.3, tracker_noise_m=0.0, tracker_noise_deg=0.0)
    times = np.arange(0.0, 40.0, 0.1)
    seen = poses(scene, times)
    lost = [p for p in seen if not p.bPoseIsValid]
    assert len(lost) / len(seen) == pytest.approx(0.3, abs=0.12)
    assert {p.eTrackingResult for p in lost} == {201}
    assert {p.eTrackingResult for p in seen if p.bPoseIsValid} == {200}


def test_stamps_are_late_as_asked_for(config):
    (pose,) = poses(faulty(config, tracker_late_ms=30.0), [1.0])
    assert pose.stamp_ns == 1000 + 30_000_000


def test_a_moved_base_station_moves_all_poses(config):
    scene = faulty(
        config,
        lighthouse_moves_s=5.0,
        lighthouse_shift_m=0.02,
        lighthouse_turn_deg=1.0,
        tracker_noise_m=0.0,
        tracker_noise_deg=0.0,
    )
    before, after = (matrix(p) for p in poses(scene, [4.9, 5.1]))
    shift = np.linalg.norm(after[:3, 3] - before[:3, 3])
    assert 0.005 < shift < 0.08
    assert np.rad2deg(angle_between(before[:3, :3], after[:3, :3])) == pytest.approx(1.0, abs=1e-3)
