"""Views of cameras that tilted since their calibration, made level."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.alignment.level_views import LevelViews, add_turns
from services.fusion.geometry.projection import extrinsics
from services.fusion.geometry.rectified_pair import rectified_pairs, rectify_rays
from services.fusion.intake.observations import View
from testing.point_errors import PointErrors
from testing.synthetic_points import MovingHand, SyntheticRig

POINTS_M = np.array([[0.0, 0.0, 0.5], [0.1, -0.1, 0.7], [-0.15, 0.05, 0.9], [0.1, 0.1, 0.6]])
MOVING = MovingHand(speed_m_s=0.5)


def view_of(camera: Camera, index: int) -> View:
    """What a camera sees of the points."""
    n = len(POINTS_M)
    rays = camera.rays_from_pixels(camera.project(POINTS_M))
    nothing = np.zeros(n)
    return View(index, 0, np.arange(n), nothing, rays, nothing, nothing, nothing > 0.0, 0, 0.0, 0)


def heights(cameras: tuple[Camera, ...], views: list[View]) -> dict[tuple[int, int], Array]:
    """Height differences of each pair by its calibration, px."""
    found = {}
    for (i, j), pair in rectified_pairs(cameras).items():
        first = rectify_rays(pair.R_rectified_from_first, views[i].rays)[:, 1]
        second = rectify_rays(pair.R_rectified_from_second, views[j].rays)[:, 1]
        found[i, j] = pair.focal_px * (first - second)
    return found


@pytest.mark.parametrize("tilt_deg", [0.1, -0.25])
@pytest.mark.parametrize("setup", [SyntheticRig(), SyntheticRig(toe_in_rad=0.1, cameras=3)])
def test_a_tilted_camera_s_views_agree_within_what_is_let_be(setup: SyntheticRig, tilt_deg: float):
    tilted = SyntheticRig(
        cameras=setup.cameras, toe_in_rad=setup.toe_in_rad, tilt_rad=np.deg2rad(tilt_deg)
    )
    cameras = tuple(setup.rig().values())
    views = [view_of(camera, n) for n, camera in enumerate(tilted.tilted_rig().values())]
    off = heights(cameras, views)
    assert max(np.abs(of).max() for of in off.values()) > 0.8
    levels = LevelViews(cameras)
    pairs = rectified_pairs(cameras)
    levels.take({pair: float(np.mean(off[pair])) / pairs[pair].focal_px for pair in pairs})
    left = heights(cameras, [levels.level(view) for view in views])
    for pair, of in left.items():
        assert np.abs(of).max() < 0.35, pair


def test_what_a_calibration_leaves_is_let_be():
    cameras = tuple(SyntheticRig().rig().values())
    view, levels = view_of(cameras[0], 0), LevelViews(cameras)
    levels.take({(0, 1): 0.09 / float(np.mean(cameras[0].focal_px))})
    assert levels.level(view) is view


def test_views_metres_apart_are_no_tilt_alone():
    """Three pixels are the most that is levelled: a share of each camera, half of them."""
    cameras = tuple(SyntheticRig().rig().values())
    levels = LevelViews(cameras)
    levels.take({(0, 1): 80.0 / float(np.mean(cameras[0].focal_px))})
    turned = levels.level(view_of(cameras[0], 0)).rays - view_of(cameras[0], 0).rays
    assert np.abs(turned).max() * float(np.mean(cameras[0].focal_px)) < 1.6


def test_points_may_be_off_by_what_cameras_are_turned():
    """Whose turn it was nobody knows: half of .2 deg at .7 m is 1.2 mm, up or down."""
    cameras = extrinsics(tuple(SyntheticRig().rig().values()))
    half = np.deg2rad(0.1)
    covs = np.zeros((1, 3, 3))
    turns = np.array([[half, 0.0, 0.0], [-half, 0.0, 0.0]])
    add_turns(turns, cameras, np.array([[0.0, 0.0, 0.7]]), covs)
    assert np.sqrt(np.diag(covs[0])) * 1e3 == pytest.approx([0.0, 1.22, 0.0], abs=0.02)


def test_a_tilted_camera_costs_little(run: Callable[..., tuple[object, PointErrors]]):
    """Expected: without lag at most half more than level, and .6 of that with them as calibrated.

    Sigma says whose tilt it was nobody knows.
    """
    lag_0 = Fusion(lag_frames=0)
    tilt_rad = np.deg2rad(-0.2)
    _, level = run(SyntheticRig(), MOVING, lag_0)
    _, tilted = run(SyntheticRig(tilt_rad=tilt_rad), MOVING, lag_0)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(LevelViews, "take", lambda _self, _heights: None)
        _, calibrated = run(SyntheticRig(tilt_rad=tilt_rad), MOVING, lag_0)
    assert rms_mm(tilted) < 1.5 * rms_mm(level)
    assert rms_mm(tilted) < 0.6 * rms_mm(calibrated)
    beyond = np.abs(tilted.errors_m) > 4.0 * tilted.sigmas_m
    assert np.mean(beyond.any(axis=1)) < 0.01


def rms_mm(found: PointErrors) -> float:
    return 1e3 * float(np.sqrt(np.mean(np.sum(found.errors_m**2, axis=1))))


def test_a_tilt_outlasts_what_was_learned_of_clocks():
    cameras = tuple(SyntheticRig().rig().values())
    view, levels = view_of(cameras[0], 0), LevelViews(cameras)
    levels.take({(0, 1): 2.0 / float(np.mean(cameras[0].focal_px))})
    level = levels.level(view).rays
    assert not np.array_equal(level, view.rays)
    levels.take({})
    assert np.array_equal(levels.level(view).rays, level)
