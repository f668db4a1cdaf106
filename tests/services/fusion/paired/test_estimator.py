"""The paired methods: hold, drop, filter."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from services.fusion.intake.observations import ObservationBuilder
from services.fusion.paired.estimator import SPEED_SIGMA, PairedMethod
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

EXACT = SyntheticRig(sigma_px=0.03, clock_error_s=0.0, loss=0.0)


def seen(fusion: Fusion, path: MovingHand, seconds: float = 1.0) -> tuple[PairedMethod, float]:
    """A method that has seen a hand, and the newest instant its views enclose."""
    cameras = EXACT.rig()
    builder = ObservationBuilder(EXACT.config(), cameras)
    method = PairedMethod(6, tuple(cameras.values()), np.full(2, 1 / 30), fusion)
    instant_s = 0.0
    for frame in frames(EXACT, path, seconds):
        view = builder.build(frame)
        instant_s = (view.instant_ns - START_NS) * 1e-9
        method.observe(view, instant_s + view.delay_s, 0.0)
    return method, instant_s - 0.1


def test_points_are_where_the_hand_is():
    path = MovingHand(speed_m_s=0.2)
    method, instant_s = seen(Fusion(method="triangulate", filter="none"), path)
    found = method.estimate(instant_s)
    assert found.measured.all()
    np.testing.assert_allclose(found.positions_m, path(np.array([instant_s]))[0], atol=3e-3)


def test_what_is_no_longer_seen_is_held_with_growing_sigma_then_dropped():
    method, instant_s = seen(
        Fusion(method="triangulate", filter="none", hold_s=0.3), MovingHand(speed_m_s=0.0)
    )
    before = method.estimate(instant_s)
    later = method.estimate(instant_s + 0.25)
    assert later.found.all()
    assert not later.measured.any()
    np.testing.assert_array_equal(later.positions_m, before.positions_m)
    growth = np.sqrt(later.covariances_m2[0, 0, 0] - before.covariances_m2[0, 0, 0])
    assert growth == pytest.approx(SPEED_SIGMA * 0.25, rel=0.01)
    assert not method.estimate(instant_s + 0.35).found.any()
    assert method.counts.dropped == 6


def test_one_euro_calms_a_resting_hand():
    scatter = {}
    for name in ("none", "one_euro"):
        cameras = EXACT.rig()
        settings = Fusion(method="triangulate", filter=name)
        method = PairedMethod(6, tuple(cameras.values()), np.full(2, 1 / 30), settings)
        builder, depths = ObservationBuilder(EXACT.config(), cameras), []
        for frame in frames(EXACT, MovingHand(speed_m_s=0.0), 4.0):
            view = builder.build(frame)
            instant_s = (view.instant_ns - START_NS) * 1e-9
            method.observe(view, instant_s + view.delay_s, 0.0)
            if frame.camera == "left" and instant_s > 1.0:
                depths.append(method.estimate(instant_s - 0.1).positions_m[:, 2])
        scatter[name] = np.std(depths, axis=0).mean()
    assert scatter["one_euro"] < 0.7 * scatter["none"]


def test_forgetting_forgets():
    method, instant_s = seen(Fusion(method="disparity"), MovingHand())
    assert method.estimate(instant_s).found.any()
    method.reset()
    assert not method.estimate(instant_s).found.any()
