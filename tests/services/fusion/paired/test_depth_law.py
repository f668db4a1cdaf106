"""The RHOT paper's depth law."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Disparity
from services.fusion.geometry.rectified_pair import rectified_pair
from services.fusion.geometry.triangulation import TriangulationStatus
from services.fusion.paired.depth_law import depth_law, locate
from testing.synthetic_points import SyntheticRig

GEOMETRY = Disparity(law="geometry")


def rays_of(cameras, p):
    q = np.array([c.T_camera_from_rig[:3, :3] @ p + c.T_camera_from_rig[:3, 3] for c in cameras])
    return q[:, :2] / q[:, 2:]


def test_eq_10_without_alignment_error_is_the_pinhole_law():
    left, right = SyntheticRig().rig().values()
    k, z = depth_law(GEOMETRY, rectified_pair(left, right))
    # B x0 / (2 tan(phi0 / 2)) with 7.5 cm, 640 px, 62.5 deg; the paper's fit is 4543.3 with z =
    # -1.035.
    assert (k, z) == (pytest.approx(7.5 * 640 / (2 * np.tan(np.deg2rad(31.25)))), -1.0)
    assert (
        depth_law(msgspec.structs.replace(GEOMETRY, phi_rad=0.01), rectified_pair(left, right))[0]
        < k
    )
    assert depth_law(Disparity(), rectified_pair(left, right)) == (4543.3, -1.035)


def test_the_papers_law_is_right_to_4_percent_on_an_ideal_pair():
    left, right = SyntheticRig().rig().values()
    pair = rectified_pair(left, right)
    for distance in np.arange(0.3, 1.01, 0.05):
        p = np.array([0.0375, 0.0, distance])
        found = locate(
            pair, rays_of((left, right), p), np.full(2, 1e-4), depth_law(Disparity(), pair), 2.0
        )
        assert found.position_m[2] == pytest.approx(distance, rel=0.04)


@pytest.mark.parametrize("swap", [False, True])
def test_geometry_places_points_of_turned_and_swapped_cameras(swap):
    cameras = tuple(SyntheticRig(toe_in_rad=0.06).rig().values())
    cameras = cameras[::-1] if swap else cameras
    pair = rectified_pair(*cameras)
    law = (100.0 * pair.baseline_m * pair.focal_px, -1.0)
    for p in np.random.default_rng(0).uniform([-0.2, -0.15, 0.3], [0.2, 0.15, 1.0], (20, 3)):
        found = locate(pair, rays_of(cameras, p), np.full(2, 1e-4), law, 2.0)
        assert found.status is TriangulationStatus.OK
        np.testing.assert_allclose(found.position_m, p, atol=1e-9)
        assert found.residual_sigma < 1e-6


def test_covariance_tells_the_scatter():
    cameras = tuple(SyntheticRig(toe_in_rad=0.03).rig().values())
    pair, random = rectified_pair(*cameras), np.random.default_rng(2)
    law, sigmas = depth_law(Disparity(), pair), np.array([1e-4, 2e-4])
    p = np.array([0.1, -0.08, 0.6])
    rays = rays_of(cameras, p)
    found = [
        locate(pair, rays + random.normal(size=(2, 2)) * sigmas[:, None], sigmas, law, 2.0)
        for _ in range(3000)
    ]
    scatter = np.std([f.position_m for f in found], axis=0)
    np.testing.assert_allclose(scatter, np.sqrt(np.diag(found[0].covariance_m2)), rtol=0.06)


def test_refuses_what_has_no_disparity():
    left, right = SyntheticRig().rig().values()
    pair, sigmas = rectified_pair(left, right), np.full(2, 1e-4)
    law = depth_law(Disparity(), pair)
    assert (
        locate(pair, np.array([[0.0, 0.0], [0.1, 0.0]]), sigmas, law, 2.0).status
        is TriangulationStatus.BEHIND
    )
    assert (
        locate(pair, np.array([[0.1, 0.0], [0.1 - 1e-3, 0.0]]), sigmas, law, 2.0).status
        is TriangulationStatus.BEYOND
    )
