"""Tips that another finger hides in part from one camera: which side, and what is made of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from services.fusion.geometry.projection import Extrinsics
from services.fusion.paint.behind_fingers import hidden_from
from services.fusion.paint.hidden_paint import HiddenPaint
from services.fusion.paint.known_paint import POSE_AGE_NS, KnownPaint
from services.fusion.paint.visible_paint import paint_tables
from testing.untold_paint import untold_paint
from testing.view_of_areas import view_of_areas

RADIUS_M, UP = 0.007, (0.0, -1.0, 0.0)
CENTRES = np.array([[0.0, 0.0, 0.0], [0.08, 0.0, 0.0]])
CAMERAS = Extrinsics(np.tile(np.eye(3), (2, 1, 1)), -CENTRES)
AHEAD = CAMERAS.R[0], CAMERAS.t[0]
TABLES = paint_tables(RADIUS_M, 0.014)
# Two fingers that point up before the left camera, the second 9 mm to the left and 2 cm nearer.
TIP, OTHER = np.array([0.0, 0.0, 0.5]), np.array([-0.009, 0.0, 0.48])


@pytest.fixture
def paint() -> Callable[..., KnownPaint]:
    """Two tips, of which a pose told at 0 s where they point."""

    def make(direction: tuple[float, ...] = UP, sigma_rad: float = 0.2) -> KnownPaint:
        return untold_paint(
            2,
            radii_m=np.full(2, RADIUS_M),
            shifts_m=np.array([TABLES.shifts_m] * 2),
            areas_m2=np.array([TABLES.areas_m2] * 2),
            directions=np.array([UP, direction]),
            hinges=np.tile((1.0, 0.0, 0.0), (2, 1)),
            direction_sigmas=np.full((2, 2), sigma_rad),
            stamps_ns=np.zeros(2, dtype=np.int64),
            viewpoint_rig=CENTRES.mean(axis=0),
        )

    return make


def side(known: KnownPaint, other: np.ndarray, instant_ns: int = 0) -> list[float] | None:
    away = np.empty(2)
    places = np.array([TIP, other])
    is_hidden = hidden_from(known, places, 0, instant_ns, AHEAD, away)
    return away.tolist() if is_hidden else None


def test_a_finger_before_a_tip_hides_its_own_side(paint):
    assert side(paint(), OTHER) == pytest.approx([1.0, 0.0], abs=0.05)
    assert side(paint(), OTHER * [-1.0, 1.0, 1.0]) == pytest.approx([-1.0, 0.0], abs=0.05)
    # It hides with what is behind its tip, too: one that is 2 cm higher, and comes from below.
    assert side(paint(), OTHER - [0.0, 0.02, 0.0]) == pytest.approx([1.0, 0.0], abs=0.05)
    # One that lies across, above the tip.
    across = side(paint((1.0, 0.0, 0.0)), np.array([0.02, -0.009, 0.48]))
    assert across == pytest.approx([0.0, 1.0], abs=0.05)


def test_what_does_not_pass_before_it_hides_nothing(paint):
    for other in (
        OTHER + np.array([0.0, 0.0, 0.04]),  # behind
        OTHER + np.array([0.0, 0.0, 0.019]),  # beside
        OTHER - np.array([0.01, 0.0, 0.0]),  # apart
        OTHER + np.array([0.0, 0.03, 0.0]),  # below, and comes from farther below
        np.full(3, np.nan),
        OTHER * [1.0, 1.0, -1.0],
    ):
        assert side(paint(), other) is None


def test_directions_that_are_old_or_unsure_tell_no_side(paint):
    assert side(paint(), OTHER, POSE_AGE_NS) is not None
    assert side(paint(), OTHER, POSE_AGE_NS + 1) is None
    assert side(paint(sigma_rad=0.7), OTHER) is None
    dab = paint()
    dab.radii_m[0] = 0.0
    assert side(dab, OTHER) is None


def test_the_centre_of_what_a_finger_hides_is_put_back(paint):
    """A disc of which a straight edge hides a part: the middle of the rest is off by so much."""
    radius = RADIUS_M / TIP[2]
    whole, share = np.pi * radius**2, 0.15
    # By numbers: the segment beyond an edge, and the centroid of the rest.
    x = np.linspace(-radius, radius, 200_001)
    height = 2.0 * np.sqrt(np.maximum(radius**2 - x**2, 0.0)) * (x[1] - x[0])
    kept = np.cumsum(height) > share * whole
    off = float((x * height)[kept].sum() / height[kept].sum())
    hidden = HiddenPaint(CAMERAS, np.full(2, True), paint())
    hidden.seen.places[:] = TIP, OTHER
    # The other camera, farther from it, sees all of both.
    scale = (np.linalg.norm(TIP) / np.linalg.norm(TIP - CENTRES[1])) ** 2
    hidden.observe(view_of_areas(1, whole * np.array([scale, 1.0])), 0.0)
    seen = view_of_areas(0, whole * np.array([1.0 - share, 1.0]))
    sigmas = hidden.observe(seen, 0.016)
    # Away from the finger it was off, to which it is put back.
    assert -seen.rays[0, 0] == pytest.approx(off, rel=0.3)
    assert abs(seen.rays[0, 1]) < 0.1 * off
    # What is left of that is told.
    assert 0.2 * off < sigmas[0] < 0.7 * off
    # The finger before it is as it was.
    assert not seen.rays[1].any()
    assert sigmas[1] == 0.0
