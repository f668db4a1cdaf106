"""Hands drawn by VTK: the skin follows the bones, and pictures show it where the truth says."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.camera import Camera, pinhole

pytest.importorskip("vtkmodules", reason="VTK is not installed: pip install 'rhot[other-renderer]'")

from testing.second_renderer.catalog.drawn import drawn, drawn_clip
from testing.second_renderer.motion import Array, Bones
from testing.second_renderer.paint import LANDMARKS, Job, landmarks_at, painted
from testing.second_renderer.pictures import Shutter, Studio
from testing.second_renderer.room import Light
from testing.second_renderer.sensor import Sensor, as_i420, developed
from testing.second_renderer.skin import Build, Skinned, hand_mesh, rest_joints
from testing.second_renderer.window import room_light

SIZE_PX = (320, 240)
# Palm to the camera, fingers up.
AXES = np.stack([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]], axis=1)


def still_hand(times_s: Array) -> Bones:
    """Straight fingers of 40, 25 and 18 mm, the knuckles 90 mm before the wrist."""
    joints = np.zeros((5, 4, 3))
    for digit in range(5):
        begin = [-0.03, -0.01, -0.03] if digit == 0 else [0.02 * (digit - 2.5), 0.0, -0.09]
        joints[digit] = begin
        joints[digit, :, 2] -= [0.0, 0.04, 0.065, 0.083]
    wrist = np.array([0.0, 0.08, 0.45])
    n = len(times_s)
    shown = joints @ AXES.T + wrist
    return Bones(np.tile(wrist, (n, 1)), np.tile(AXES, (n, 1, 1)), np.tile(shown, (n, 1, 1, 1)))


@pytest.fixture(scope="module")
def hand():
    bones = still_hand(np.zeros(1))
    mesh = hand_mesh(bones, Build())
    return bones, Skinned(mesh), painted(mesh, Job())


def test_the_skin_at_rest_is_the_mesh(hand):
    bones, skinned, _ = hand
    rest = rest_joints(bones)
    vertices, normals = skinned.pose(np.zeros(3), np.eye(3), rest)
    assert np.allclose(vertices, skinned.mesh.vertices, atol=1e-9)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)


def test_paint_is_seen_about_its_landmark(hand):
    bones, skinned, paint = hand
    camera = Camera("left", SIZE_PX, pinhole(SIZE_PX, 1.1), np.zeros(5), np.eye(4))
    light = Light()
    studio = Studio(still_hand, skinned, paint, light)
    room = room_light(camera, light, seed=1)
    taken = studio.take(camera, room, 0.0, Shutter())
    studio.close()
    truth_px = camera.project(landmarks_at(paint, *(part[0] for part in bones)))
    for row, name in enumerate(LANDMARKS):
        assert taken.shares[row] > 0.9, name
        middle = np.mean(taken.paint_px[row], axis=0)
        # Fingers of 7 mm are 4 px wide here.
        assert np.linalg.norm(middle - truth_px[row]) < 2.5, name
    assert 0.05 < taken.covered.mean() < 0.5
    picture = as_i420(developed(taken.light, Sensor(), (1,)))
    assert picture.shape == (360, 320)
    assert picture[:240].std() > 10.0


@pytest.mark.usefixtures("rhot_data")
def test_clips_by_number_are_in_view_and_always_the_same():
    clips = {number: drawn_clip(number) for number in (0, 5, 1000)}
    assert len({repr(clip) for clip in clips.values()}) == 3
    assert clips[5] == drawn_clip(5) == drawn("tuning", 6)["no. 5"]
    assert clips[1000] == drawn("held_out", 1)["no. 1000"]
    times_s = np.linspace(0.0, 8.0, 200)
    for clip in clips.values():
        bones = clip.play.bones(times_s)
        for camera in clip.rig.cameras().values():
            tips_px = camera.project(bones.joints[:, :, -1].reshape(-1, 3))
            assert np.all((tips_px > 20.0) & (tips_px < np.array(camera.size_px) - 20.0))
