"""Pictures agree with the ground truth: geometry, rolling shutter, motion blur, noise."""

from __future__ import annotations

import dataclasses

import cv2
import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import HandTable
from rhot.geometry.camera import Camera
from rhot.hand import landmark_point
from services.simulator.camera.visibility import patch_visibility
from services.simulator.render.renderer import Renderer
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import Scene, build_scene, load_scene


def projected(scene: Scene, camera: Camera, landmark: str, t_s: float) -> np.ndarray:
    """Pixel (2,) of the right hand's landmark point at t_s."""
    hand = scene.hands["right"]
    point = landmark_point(hand.model, landmark, *hand.joints(hand.state_at(t_s)))
    return camera.project(point)[0]


@pytest.mark.parametrize("camera", ["left", "right"])
def test_paint_lies_where_the_truth_says(config, camera):
    for name in ("still", "piano", "fist"):
        scene = load_scene(config, name, seed=4)
        renderer = Renderer(scene, camera)
        for frame in (3, 40, 77):
            t_s = renderer.clock.time_s(frame)
            for (_, landmark), patch in patch_visibility(renderer, t_s).items():
                if patch.share < 0.95:
                    continue
                own_s = t_s + patch.centre_px[1] * renderer.clock.row_time_ns * 1e-9
                off = np.array(patch.centre_px) - projected(
                    scene, scene.cameras[camera], landmark, own_s
                )
                # The middle of a patch seen at a slant is not the point that stands for it: up to 2
                # px = 2 mm at 0.5 m.
                assert np.hypot(*off) < 2.5, (name, frame, landmark, off)
                # Pixels of a tip: 14 mm by twice its radius, seen from the side or from its end.
                assert 80 < patch.visible_px < 420, (name, frame, landmark)


def test_rows_are_taken_one_after_the_other(fast):
    renderer = Renderer(fast, "left")
    camera, row_s = fast.cameras["left"], renderer.clock.row_time_ns * 1e-9
    right, wrong = [], []
    for frame in range(0, 30, 2):
        t_s = renderer.clock.time_s(frame)
        for (_, landmark), patch in patch_visibility(renderer, t_s).items():
            rows_later_s = patch.centre_px[1] * row_s
            right.append(
                patch.centre_px[0] - projected(fast, camera, landmark, t_s + rows_later_s)[0]
            )
            wrong.append(patch.centre_px[0] - projected(fast, camera, landmark, t_s)[0])
    # The patch's own shape makes up to a pixel; 6 ms at 1.3 m/s would be 8.
    assert np.std(right) < 0.8
    assert np.std(wrong) > 3.0


def test_motion_blur_is_the_mean_over_the_exposure(fast):
    blurred = Renderer(fast, "left")
    still = Renderer(fast, "left")
    still.clock = dataclasses.replace(still.clock, exposure_s=1e-7)
    exposure_s = blurred.clock.exposure_s
    # Where the hand rushes by: x = A sin(wt) at t = 0.5 s.
    t_s = 0.5
    instants = t_s + exposure_s * ((np.arange(24) + 0.5) / 24 - 0.5)

    def light(renderer: Renderer, at_s: float) -> np.ndarray:
        renderer.clean(at_s)
        return renderer.light.astype(np.float64)

    mean = np.mean([light(still, float(t)) for t in instants], axis=0)
    sharp, ours = light(still, t_s), light(blurred, t_s)
    smeared = np.abs(mean - sharp).max(axis=2) > 0.03
    assert smeared.sum() > 1500
    error, blur = (np.sqrt(np.mean((picture - mean)[smeared] ** 2)) for picture in (ours, sharp))
    # Eight samples a pixel scatter; their neighbourhood does not.
    assert error < 0.4 * blur
    local = cv2.blur(ours - mean, (5, 5))[smeared]
    assert np.sqrt(np.mean(local**2)) < 0.12 * blur
    # And no light is lost or gained.
    assert abs((ours - mean)[smeared].mean()) < 0.02 * blur


def test_outlines_are_smooth(config):
    """A hand that moves by a quarter of a pixel changes the picture a quarter as much as by one."""
    renderer = Renderer(load_scene(config, "still"), "left")
    mask = renderer.labels(0.5) == 1 + renderer.shapes.paint_surfaces["right", "index_tip"]
    rows, columns = np.nonzero(mask)
    window = np.s_[rows.min() - 3 : rows.max() + 4, columns.min() - 3 : columns.max() + 4]

    def centroid(t_s: float) -> np.ndarray:
        """Middle (x, y) of the blue light, weighted so that wall and skin count nothing."""
        renderer.clean(t_s)
        blue = renderer.light[window] @ (0.300, -1.219, 1.0)
        y, x = np.mgrid[: blue.shape[0], : blue.shape[1]]
        return np.array([(blue * x).sum(), (blue * y).sum()]) / blue.sum()

    times = 0.5 + np.arange(0.0, 0.5, 0.02)
    seen = np.array([centroid(float(t)) for t in times])
    row_s = rows.mean() * renderer.clock.row_time_ns * 1e-9
    true = np.array(
        [projected(renderer.scene, renderer.camera, "index_tip", float(t) + row_s) for t in times]
    )
    wobble = (seen - seen.mean(axis=0)) - (true - true.mean(axis=0))
    assert np.ptp(true, axis=0).max() > 0.3
    assert np.abs(wobble).max() < 0.08


def test_the_same_frame_again_is_the_same(fist, renderer):
    again = Renderer(fist, "left")
    for frame in (5, 61):
        np.testing.assert_array_equal(renderer.picture(frame), again.picture(frame))
    # And does not depend on what was drawn before.
    again.picture(7)
    again.labels(3.3)
    np.testing.assert_array_equal(renderer.picture(5), again.picture(5))
    assert np.any(renderer.picture(5) != renderer.picture(6))


def test_pictures_differ_with_seed_and_camera(config, renderer):
    other_seed = Renderer(load_scene(config, "fist", seed=9), "left")
    other_camera = Renderer(load_scene(config, "fist", seed=1), "right")
    for other in (other_seed, other_camera):
        assert np.mean(other.picture(5) != renderer.picture(5)) > 0.3


def test_noise_is_as_strong_as_said_and_new_in_every_frame(renderer, planes):
    def noise(frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        noisy, clean = renderer.picture(frame), renderer.clean(renderer.clock.time_s(frame))
        return tuple(a - b for a, b in zip(planes(noisy), planes(clean), strict=True))

    first, second = noise(4), noise(5)
    sigma = renderer.scene.spec.noise
    # Independent channels of sigma each make .574 sigma of luma (BT.601); one of the three is as
    # noisy as the others.
    assert np.std(first[0]) == pytest.approx(0.574 * sigma, rel=0.12)
    for plane in (1, 2):
        # White noise would average to half of .55 sigma over 2x2 pixels; demosaiced noise is
        # correlated and stays stronger.
        assert 0.3 * sigma < np.std(first[plane]) < 0.55 * sigma
    for a, b in zip(first, second, strict=True):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.05
        assert abs(np.mean(a)) < 0.1


def test_any_joint_can_be_painted(config):
    markers = {"middle_proximal": "red", "wrist": "violet", "palm": "yellow"}
    rig: RigConfig = msgspec.structs.replace(config, hand={"right": HandTable(markers=markers)})
    renderer = Renderer(load_scene(rig, "still"), "left")
    seen = patch_visibility(renderer, 0.1)
    assert seen["right", "wrist"].visible_px > 100
    # Dabs of other joints are on the back of the hand, which the cameras do not see.
    assert seen["right", "middle_proximal"].visible_px == 0
    assert seen["right", "palm"].share == 0.0


def test_a_hand_outside_the_picture_leaves_the_wall(config):
    bare = msgspec.structs.replace(config, object=[])
    away = build_scene(
        bare, dataclasses.replace(SCENES["still"], shift_m=(5.0, 0.0)), "away", seed=1
    )
    near = build_scene(bare, dataclasses.replace(SCENES["still"], distance_m=0.01), "near", seed=1)
    for scene in (away, near):
        renderer = Renderer(scene, "left")
        assert not renderer.labels(0.1).any() or scene is near
        assert renderer.picture(0).shape == (720, 640)
