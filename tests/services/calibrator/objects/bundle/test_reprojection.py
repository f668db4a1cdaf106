"""Derivatives of the reprojection against finite differences."""

from __future__ import annotations

import numpy as np

from services.calibrator.objects.bundle.reprojection import Unknowns, reproject, scene
from services.calibrator.objects.sightings import sightings
from services.calibrator.objects.tracker_path import tracker_path
from testing.synthetic_points import SyntheticRig
from testing.synthetic_tracker import COLOR, Lighthouse, TrackerMotion, painted_frames


def two_trackers():
    """A scene of two trackers, and unknowns somewhat off the truth."""
    rig, lighthouse = SyntheticRig(sigma_px=0.3), Lighthouse()
    seen, motions = [], []
    for seed in (1, 2):
        motion = TrackerMotion(seed=seed)
        frames = painted_frames(rig, motion, (0.01, 0.03, -0.02), 2.0)
        seen.append(sightings(frames, rig.rig(), COLOR))
        path = tracker_path(lighthouse.poses(motion, 2.0))
        motions.append(path.motion(seen[-1].stamps_ns, 0.03))
    at = scene(seen, motions, np.array([0.03, 0.03]))
    markers = np.array([[0.012, 0.028, -0.021], [0.008, 0.031, -0.02]])
    return at, Unknowns(lighthouse.T_rig_from_lighthouse(), markers, np.array([0.031, 0.029]))


def test_derivatives_are_those_of_the_projection():
    at, unknowns = two_trackers()
    middle = np.array([0.3, -0.2, 0.5])
    result = reproject(at, unknowns, middle)
    for k in range(result.jacobian.shape[2]):
        step = np.zeros(result.jacobian.shape[2])
        step[k] = 1e-5
        plus = reproject(at, unknowns.stepped(step, middle), middle).residual_px
        minus = reproject(at, unknowns.stepped(-step, middle), middle).residual_px
        # The residual falls along the prediction's derivative.
        expected = (minus - plus) / 2e-5
        scale = np.abs(expected).max()
        assert np.abs(result.jacobian[:, :, k] - expected).max() < 1e-5 * scale + 1e-6


def test_sightings_of_an_unknown_instant_are_left_out():
    at, _ = two_trackers()
    assert at.motion.known.all()
    assert 200 < len(at.stamps_s) <= 240
