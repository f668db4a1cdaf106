"""Markers of which one camera sees less than another; and rendered fingers before each other."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from rhot.files.config import load_rig
from rhot.hand import landmark_point
from services.fusion.intake.observations import View
from services.fusion.output.hidden_paint import HiddenPaint
from services.fusion.step import FusionStep
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import build_scene
from testing.rendered_markers import detect
from testing.synthetic_points import START_NS

CENTRES = np.array([[0.0, 0.0, 0.0], [0.075, 0.0, 0.0]])
# A tip, and a dab beside it.
PLACES = np.array([[0.03, 0.0, 0.5], [0.05, 0.02, 0.52]])
AREA = (13.0 / 527.0) ** 2


@pytest.fixture
def paint() -> HiddenPaint:
    paint = HiddenPaint(CENTRES, np.array([True, False]))
    paint.places[:] = PLACES
    return paint


def look(camera: int, *areas: float) -> View:
    return View(
        camera=camera,
        instant_ns=0,
        landmarks=np.arange(2),
        delay_s=np.zeros(2),
        rays=np.zeros((2, 2)),
        sigmas=np.full(2, 2e-4),
        areas=AREA * np.array(areas),
        clock_offset_ns=0,
        clock_sigma_s=0.0,
        ignored=0,
    )


def test_alike_is_whole_and_less_is_hidden(paint):
    paint.observe(look(0, 1.0, 1.0), 0.0)
    assert not paint.observe(look(1, 0.93, 0.85), 0.016).any()
    # From another side a dab may look that much smaller, a tip may not.
    tip, dab = paint.observe(look(1, 0.75, 0.8), 0.02)
    assert tip > 0.0
    assert dab == 0.0
    # A third of it: some 3 px of a marker 13 px wide.
    third = paint.observe(look(1, 0.33, 1.0), 0.03)[0] * 527.0
    assert 2.5 < third < 5.0
    # It is the smaller one that is off.
    assert not paint.sigmas[:, 0].any()


def test_it_is_forgotten_after_a_while(paint):
    paint.observe(look(0, 1.0, 1.0), 0.0)
    hidden = paint.observe(look(1, 0.4, 1.0), 0.016)[0]
    paint.observe(look(0, 1.0, 1.0), 0.033)
    assert 0.0 < paint.observe(look(1, 1.0, 1.0), 0.05)[0] < hidden
    paint.observe(look(0, 1.0, 1.0), 1.0)
    assert paint.observe(look(1, 1.0, 1.0), 1.016)[0] < 0.01 * hidden
    # A camera that has not looked lately is not compared with.
    assert paint.observe(look(1, 0.3, 1.0), 2.0)[0] < 0.01 * hidden


def test_a_nearer_camera_sees_more():
    """Twice as near is four times the area, and nothing is hidden of either."""
    centres = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.25]])
    paint = HiddenPaint(centres, np.array([True, False]))
    paint.places[:] = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.5]])
    paint.observe(look(1, 4.0, 4.0), 0.0)
    assert not paint.observe(look(0, 1.0, 1.0), 0.01).any()
    assert paint.observe(look(0, 0.5, 1.0), 0.02)[0] > 0.0


def test_nothing_is_known_without_a_place():
    paint = HiddenPaint(CENTRES, np.array([True, False]))
    for places in (np.full((2, 3), np.nan), np.zeros((2, 3)), np.tile(CENTRES[1], (2, 1))):
        paint.places[:] = places
        paint.observe(look(0, 1.0, 1.0), 0.0)
        assert not paint.observe(look(1, 0.2, 0.2), 0.01).any()
    paint.places[:] = PLACES
    assert not paint.observe(look(1, 0.0, 0.0), 0.02).any()
    paint.reset()
    assert not paint.sigmas.any()


def test_sigmas_cover_fingers_that_pass_before_each_other(repository: Path):
    """A fist seen from the thumb's side, rendered: tips of which one camera sees a part."""
    config = load_rig(repository / "config" / "sim.toml")
    spec = dataclasses.replace(SCENES["fist"], yaw_deg=55.0, tilt_deg=20.0, roll_deg=0.0)
    scene = build_scene(config, spec, "fist", 12)
    hand = scene.hands["right"]
    step, squares, sigmas_m = FusionStep(config, scene.cameras, {"right": hand.model}), [], []
    for frame in detect(config, scene, 3.0):
        for points in step.step(frame):
            joints = hand.joints(hand.state_at((points.stamp_ns - START_NS) * 1e-9))
            for point in points.points:
                error = np.array(point.position_m) - landmark_point(hand.model, point.name, *joints)
                squares.append(np.mean((error / point.sigma_m) ** 2))
                sigmas_m.append(point.sigma_m[2])
    assert 0.3 < np.mean(squares) < 2.0
    # The whole ones stay small: half of all points within 3 mm in depth.
    assert np.median(sigmas_m) < 3e-3 < np.percentile(sigmas_m, 95)
