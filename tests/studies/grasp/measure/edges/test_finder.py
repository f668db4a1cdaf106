"""A plain rendered finger, followed by its outline and its skin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.measure.edges.finder import EdgeFinder
from studies.grasp.measure.edges.segments import edges_near


def followed(frames, seeds):
    finder = EdgeFinder("index", seeds)
    for frame in frames:
        finder.look(frame)
    return finder.seen()


def test_angles_of_a_plain_finger(plain, angle_errors):
    experiment, frames, seeds = plain
    errors, recording = angle_errors(experiment, followed(frames, seeds), seeds, "edges")
    assert len(errors) == 3 * len(frames)
    assert np.sqrt(np.mean(np.square(errors))) < 2.5
    told = np.degrees([s for frame in recording.frames for s in frame.angles_sigma_rad.values()])
    assert 0.3 < np.median(told) < 5.0


def test_clicks_that_are_off_are_corrected_by_the_outline(plain, angle_errors):
    """1.5 px across the bone at the DIP joint are 4 degrees there."""
    experiment, frames, seeds = plain
    x, y = seeds["index_dip"]
    seen = followed(frames, {**seeds, "index_dip": (x, y - 1.5)})
    errors, _ = angle_errors(experiment, seen, seeds, "edges")
    assert np.sqrt(np.mean(np.square(errors))) < 3.0


def test_a_base_line_is_not_needed(plain):
    _, frames, seeds = plain
    joints = {place: at for place, at in seeds.items() if place[-2:] not in ("b1", "b2")}
    seen = followed(frames[:3], joints)
    assert set(seen[2].places) == set(joints)


def test_no_finger_and_seeds_beside_it(plain):
    _, frames, seeds = plain
    empty = replace(frames[0], image=np.full_like(frames[0].image, 150))
    with pytest.raises(CaptureError, match="no finger is seen"):
        EdgeFinder("index", seeds).look(empty)
    aside = {place: (x, y - 90.0) for place, (x, y) in seeds.items()}
    with pytest.raises(CaptureError, match="seeds index_mcp and index_pip"):
        EdgeFinder("index", aside).look(frames[0])


def test_a_finger_that_vanishes_is_told_and_found_again(plain):
    experiment, frames, seeds = plain
    gone = replace(frames[1], image=np.full_like(frames[1].image, 150))
    seen = followed([frames[0], gone, frames[1]], seeds)
    assert set(seen[1].lost) == {"index_mcp", "index_pip", "index_dip", "index_tip"}
    assert "its outline is hidden" in seen[1].lost["index_tip"]
    assert not seen[2].lost
    tip = experiment.pixels_of(1)["tip"]
    assert np.hypot(*(np.array(seen[2].places["index_tip"][:2]) - tip)) < 4.0


def test_no_picture_has_no_joints(plain):
    assert EdgeFinder("index", plain[2]).seen() == []


def test_edges_of_nothing():
    flat = np.full((60, 80), 90, np.uint8)
    assert len(edges_near(flat, np.array([(20.0, 20.0), (60.0, 30.0)]), 10.0).points) == 0
    assert len(edges_near(flat, np.array([(200.0, 20.0), (210.0, 30.0)]), 10.0).points) == 0


@pytest.mark.parametrize(("phalanges", "turn"), [([5], -0.6), ([4, 5], 0.35), ([4, 5], -0.35)])
def test_phalanges_looked_for_where_they_are_not_are_found(plain, phalanges, turn):
    """The last one or two are expected 20 degrees off and more."""
    _, frames, seeds = plain
    vectors = []
    for expected in (0.0, turn):
        finder = EdgeFinder("index", seeds)
        for frame in frames[:3]:
            finder.look(frame)
        finder._follower._vector[phalanges] += expected
        finder.look(frames[3])
        vectors.append(finder._followed[-1].vector[2:])
    assert np.degrees(np.abs(vectors[1] - vectors[0])).max() < 1.0
