"""A tilted camera's picture, as one straight from the front has it."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.measure.flat import flat_about
from studies.grasp.measure.joints import Place, Seen
from studies.grasp.metrology.plane import plane_from_points
from testing.grasp_pictures import frame_of

MM = np.array([(0.0, 0.0), (90.0, 0.0), (90.0, 60.0), (0.0, 60.0)])
# Seen from the side: what is further to the right is smaller.
PX = np.array([(100.0, 80.0), (400.0, 110.0), (400.0, 270.0), (100.0, 300.0)])
SIZE = (500, 400)
SEEDS = {"index_mcp": (180.0, 150.0), "index_tip": (260.0, 200.0)}


@pytest.mark.parametrize("mirrored", [False, True])
def test_lengths_are_alike_everywhere_and_the_seeds_are_as_large(mirrored):
    plane = plane_from_points(PX, MM * (1.0, -1.0) if mirrored else MM)
    flat = flat_about(plane, SEEDS, SIZE)
    corners = list(flat.seeds({str(n): tuple(at) for n, at in enumerate(PX.tolist())}).values())
    sides = np.hypot(*np.diff([*corners, corners[0]], axis=0).T)
    assert sides[[0, 1]] / sides[[2, 3]] == pytest.approx(1.0, abs=1e-6)
    assert sides[0] / sides[1] == pytest.approx(1.5, abs=1e-6)
    (mcp, tip), (flat_mcp, flat_tip) = (
        np.array(list(s.values())) for s in (SEEDS, flat.seeds(SEEDS))
    )
    assert np.hypot(*(flat_tip - flat_mcp)) == pytest.approx(np.hypot(*(tip - mcp)), rel=0.2)
    # Not mirrored: which way a finger bends on the screen stays.
    assert np.linalg.det(np.diff(corners[:3], axis=0)) > 0.0


def test_what_is_seen_flat_is_carried_back():
    flat = flat_about(plane_from_points(PX, MM), SEEDS, SIZE)
    moved = flat.seeds(SEEDS)
    seen = Seen(3, 0.1, {name: Place(x, y, 0.5) for name, (x, y) in moved.items()}, {})
    back = flat.back(seen)
    for name, at in SEEDS.items():
        assert back.places[name][:2] == pytest.approx(at, abs=1e-6)
        assert back.places[name].sigma_px == pytest.approx(0.5, rel=0.3)
    assert flat.back(seen._replace(places={})).places == {}


def test_the_flat_picture_shows_what_the_picture_does():
    image = np.full((400, 500, 3), 30, np.uint8)
    x, y = SEEDS["index_tip"]
    image[int(y) - 6 : int(y) + 7, int(x) - 6 : int(x) + 7] = 220
    flat = flat_about(plane_from_points(PX, MM), SEEDS, SIZE)
    front = flat.frame(frame_of(image, 0))
    rows, columns = np.nonzero(front.image[..., 0] > 125)
    tip = flat.seeds(SEEDS)["index_tip"]
    assert (columns.mean(), rows.mean()) == pytest.approx(tip, abs=0.6)


def test_nothing_of_the_picture_is_left_out():
    flat = flat_about(plane_from_points(PX, MM), SEEDS, SIZE)
    corners = {"a": (1.0, 1.0), "b": (498.0, 1.0), "c": (498.0, 398.0), "d": (1.0, 398.0)}
    shown = np.array(list(flat.seeds(corners).values()))
    assert (shown >= 0.0).all()
    assert (shown <= flat.size_px).all()


def test_a_plane_seen_far_askance_has_no_endless_picture():
    steep = np.array([(100.0, 80.0), (400.0, 180.0), (400.0, 200.0), (100.0, 300.0)])
    flat = flat_about(plane_from_points(steep, MM), SEEDS, SIZE)
    assert max(flat.size_px) <= 2.0 * 500
    assert all((0.0, 0.0) < at < flat.size_px for at in flat.seeds(SEEDS).values())
