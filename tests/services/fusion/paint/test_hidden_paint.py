"""Markers of which one camera sees less than another; and rendered fingers before each other."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from rhot.files.config import load_rig
from rhot.hand import landmark_point
from services.fusion.geometry.projection import Extrinsics
from services.fusion.intake.observations import View
from services.fusion.paint.hidden_paint import HiddenPaint
from services.fusion.paint.known_paint import PAINT, KnownPaint, note_directions
from services.fusion.paint.visible_paint import paint_tables
from services.fusion.step import FusionStep
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import build_scene
from testing.rendered_markers import detect
from testing.synthetic_points import START_NS
from testing.untold_paint import untold_paint
from testing.view_of_areas import view_of_areas

CENTRES = np.array([[0.0, 0.0, 0.0], [0.075, 0.0, 0.0]])


def looking_ahead(centres: np.ndarray) -> Extrinsics:
    """Cameras at centres (C, 3) whose axes are the rig's."""
    return Extrinsics(np.tile(np.eye(3), (len(centres), 1, 1)), -centres)


# A tip, and a dab beside it.
PLACES = np.array([[0.03, 0.0, 0.5], [0.05, 0.02, 0.52]])
AREA = (13.0 / 527.0) ** 2


TABLES = paint_tables(0.0068, 0.014)
# Of the tip as it looks from the side.
SIDE = float(TABLES.areas_m2[30]) / 0.5**2 / AREA


def known_paint() -> KnownPaint:
    """Of a tip and a dab, of which no pose has told anything yet."""
    nothing = np.zeros(TABLES.shifts_m.size)
    return untold_paint(
        2,
        radii_m=np.array([0.0068, 0.0]),
        shifts_m=np.array([TABLES.shifts_m, nothing]),
        areas_m2=np.array([TABLES.areas_m2, nothing]),
        viewpoint_rig=CENTRES.mean(axis=0),
    )


def told(paint: KnownPaint, direction: tuple[float, ...], sigma_rad: float) -> None:
    """A pose tells where the tip points, at 0 s."""
    rows, hinges = np.array([0]), np.array([[1.0, 0.0, 0.0]])
    sigmas = np.array([[sigma_rad, 0.0]])
    packed = PAINT.pack(paint)
    note_directions(packed.address, rows, np.array([direction]), hinges, sigmas, 1.0, 0)


@pytest.fixture
def paint() -> HiddenPaint:
    paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known_paint())
    paint.seen.places[:] = PLACES
    return paint


def look(camera: int, *areas: float) -> View:
    return view_of_areas(camera, AREA * np.array(areas))


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
    # It is the smaller one that is off; what no pose told is not expected.
    assert not paint.seen.sigmas[0, :, 0].any()
    assert not paint.seen.sigmas[1].any()


def test_what_the_edge_cuts_is_off_by_all_of_its_sigma(paint):
    cut = look(0, 1.0, 1.0)._replace(cut=np.array([True, False]), sigmas=np.array([2e-3, 2e-3]))
    assert paint.observe(cut, 0.0).tolist() == [2e-3, 0.0]
    assert paint.seen.sigmas[0, :, 0].tolist() == [2e-3, 0.0]


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
    paint = HiddenPaint(looking_ahead(centres), np.array([True, False]), known_paint())
    paint.seen.places[:] = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.5]])
    paint.observe(look(1, 4.0, 4.0), 0.0)
    assert not paint.observe(look(0, 1.0, 1.0), 0.01).any()
    assert paint.observe(look(0, 0.5, 1.0), 0.02)[0] > 0.0


def test_what_is_hidden_from_all_cameras_shows_by_its_pose():
    known = known_paint()
    paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known)
    paint.seen.places[:] = PLACES
    told(known, (0.0, -1.0, 0.0), 0.1)
    for frame in range(300):
        paint.observe(look(frame % 2, SIDE, 1.0), frame / 60)
    assert not paint.seen.sigmas[1].any()
    # A third of it behind another finger, for both cameras: .3 of a third of its width.
    for camera in (0, 1):
        paint.observe(look(camera, 0.67 * SIDE, 1.0), 5.2 + camera / 60)
    width_px = 527.0 * np.sqrt(SIDE * AREA)
    sigmas_px = paint.seen.sigmas[1, 0] * 527.0
    assert np.all((0.05 * width_px < sigmas_px) & (sigmas_px < 0.12 * width_px))
    # The filter is not told, nor is it a difference between cameras; a dab has no such area.
    assert not paint.seen.sigmas[0].any()
    assert not paint.seen.sigmas[1, 1].any()
    # It is forgotten as the tip shows again.
    for frame in range(60):
        paint.observe(look(frame % 2, SIDE, 1.0), 0.75 + frame / 60)
    assert np.all(paint.seen.sigmas[1, 0] * 527.0 < 1e-3 * width_px)


def test_a_tip_that_turns_away_or_is_darker_for_good_is_not_hidden():
    known = known_paint()
    paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known)
    paint.seen.places[:] = PLACES
    told(known, (0.0, -1.0, 0.0), 0.1)
    paint.observe(look(0, SIDE, 1.0), 0.0)
    # It points at the camera and shows its end alone.
    ahead = -PLACES[0] / np.linalg.norm(PLACES[0])
    told(known, tuple(ahead), 0.1)
    paint.observe(look(0, SIDE * float(TABLES.areas_m2[-1] / TABLES.areas_m2[30]), 1.0), 0.03)
    assert not paint.seen.sigmas[1].any()
    # As dark as that from the side, it counts as hidden, and as usual after half a minute.
    told(known, (0.0, -1.0, 0.0), 0.1)
    paint.observe(look(0, 0.6 * SIDE, 1.0), 0.06)
    assert paint.seen.sigmas[1, 0, 0] > 0.0
    for frame in range(900):
        paint.observe(look(0, 0.6 * SIDE, 1.0), 5.3 + frame / 30)
    assert paint.seen.sigmas[1, 0, 0] < 1e-6


def test_what_makes_all_tips_smaller_hides_none():
    """Blur, or light that goes: three tips that are smaller by a third at once, then one alone."""
    known = known_paint()
    known = known._replace(
        **{name: np.repeat(value[:1], 3, axis=0) for name, value in known._asdict().items()}
    )
    paint = HiddenPaint(looking_ahead(CENTRES), np.full(3, True), known)
    paint.seen.places[:] = PLACES[0]
    rows, down, hinges = (
        np.arange(3),
        np.tile((0.0, -1.0, 0.0), (3, 1)),
        np.tile((1.0, 0, 0), (3, 1)),
    )
    packed = PAINT.pack(known)
    note_directions(packed.address, rows, down, hinges, np.full((3, 2), 0.05), 1.0, 0)

    def seen(*areas: float) -> View:
        return look(0, 1.0, 1.0)._replace(landmarks=rows, areas=SIDE * AREA * np.array(areas))

    paint.observe(seen(1.0, 1.0, 1.0), 0.0)
    paint.observe(seen(0.67, 0.7, 0.65), 0.03)
    assert not paint.seen.sigmas[1].any()
    paint.observe(seen(1.0, 0.67, 1.0), 0.06)
    assert (paint.seen.sigmas[1, :, 0] > 0.0).tolist() == [False, True, False]


def test_an_unsure_pose_or_shape_explains_a_small_area():
    for sigma_rad, shape_sd, hidden in ((0.1, 0.0, True), (1.2, 0.0, False), (0.1, 0.3, False)):
        known = known_paint()
        paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known)
        paint.seen.places[:] = PLACES
        told(known, (0.0, -1.0, 0.0), sigma_rad)
        paint.observe(look(0, SIDE, 1.0), 0.0)
        known.shape_sds[:] = shape_sd
        paint.observe(look(0, 0.75 * SIDE, 1.0), 0.03)
        assert (paint.seen.sigmas[1, 0, 0] > 0.0) == hidden


def test_nothing_is_known_without_a_place():
    paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known_paint())
    for places in (np.full((2, 3), np.nan), np.zeros((2, 3)), np.tile(CENTRES[1], (2, 1))):
        paint.seen.places[:] = places
        paint.observe(look(0, 1.0, 1.0), 0.0)
        assert not paint.observe(look(1, 0.2, 0.2), 0.01).any()
    paint.seen.places[:] = PLACES
    assert not paint.observe(look(1, 0.0, 0.0), 0.02).any()
    paint.reset()
    assert not paint.seen.sigmas.any()


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


def test_paint_that_flickers_for_one_camera_is_less_sure():
    """A piece that comes and goes, .1 of a marker 13 px wide: some tenths of a pixel."""
    paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known_paint())
    paint.seen.places[:] = PLACES
    told = []
    for frame in range(12):
        paint.observe(look(0, 1.0, 1.0), frame / 30)
        told.append(paint.observe(look(1, 0.96 + 0.08 * (frame % 2), 1.0), frame / 30 + 0.016))
    tip, dab = told[-1]
    assert 0.5 < tip / (0.2 * 0.04 * np.sqrt(AREA)) < 1.2
    assert dab == 0.0


def test_paint_that_turns_is_as_sure_as_ever():
    """All cameras see it grow and shrink."""
    paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known_paint())
    paint.seen.places[:] = PLACES
    for frame in range(40):
        area = np.exp(0.3 * np.sin(frame / 8))
        assert not paint.observe(look(frame % 2, area, 1.0), frame / 60).any()


def test_areas_tell_how_unlike_its_model_a_hand_is():
    """By how they scatter over time: of paint that is larger than the model's throughout, nothing,
    nor of what a finger hides from one camera."""
    found = []
    for larger, swing, hidden in (
        (1.0, 0.0, 1.0),
        (1.5, 0.0, 1.0),
        (1.0, 0.3, 1.0),
        (1.0, 0.0, 0.5),
    ):
        known = known_paint()
        paint = HiddenPaint(looking_ahead(CENTRES), np.array([True, False]), known)
        paint.seen.places[:] = PLACES
        told(known, (0.0, -1.0, 0.0), 0.1)
        for frame in range(300):
            area = larger * SIDE * np.exp(swing * np.sin(frame / 20))
            paint.observe(look(0, area, 1.0), frame / 30)
            paint.observe(
                look(1, area * (hidden if frame % 60 < 15 else 1.0), 1.0), frame / 30 + 0.01
            )
        assert known.shape_sds[0] == known.shape_sds[1]
        found.append(known.shape_sds[0])
    alike, large, unlike, behind = found
    assert alike == large == 0.0
    assert unlike > 0.1
    assert behind == 0.0
