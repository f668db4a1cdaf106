"""Fewer markers: what is predicted is what noise does, and more markers are never worse."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.compare.markers import Noise, choices, fewest, noise_of
from studies.grasp.compare.paths import tip_path
from studies.grasp.track import FingerTrack
from testing.synthetic_fingers import PEOPLE, Motion, recorded_person


def silent(_: int):
    return lambda: None


@pytest.fixture(scope="module")
def made(paths):
    return {one.markers: one for one in choices(paths[:3], noise_of(paths, 0.2), silent)}


def test_noise_comes_from_the_recordings(paths):
    assert noise_of(paths, 0.2).point == pytest.approx(0.05 / 86.0, rel=0.1)


def test_all_markers_find_the_angles_and_one_does_not(made):
    every = made["mcp", "pip", "dip", "tip", "direction"]
    assert max(every.found_deg) < 0.4
    assert made["tip",].found_deg[2] > 3.0
    assert made["pip",].found_deg[1] > 10.0
    # The tip's pose with the knuckle: what the paper's two markers come to.
    assert made["mcp", "dip", "tip"].worst_deg < 1.5


def test_more_markers_are_predicted_to_be_no_worse(made):
    for markers, one in made.items():
        for more, other in made.items():
            if set(markers) < set(more):
                assert (np.array(other.predicted_deg) <= np.array(one.predicted_deg) + 1e-6).all()


def test_what_is_predicted_is_what_noise_does():
    """All joints with noise of 0.4 mm, against the angles without."""
    noise_mm = 0.4
    noisy, clean = (
        tip_path("s3", recorded_person(PEOPLE[2], Motion(cycles=2, fps=60.0, noise_mm=noise)))
        for noise in (noise_mm, 0.0)
    )
    tracks = []
    for one in noisy.tracks:
        # The same instants of the finger without noise: closings are found a little differently.
        true = clean.tracks[len(tracks)]
        columns = np.array([np.interp(one.times_s, true.times_s, c) for c in true.columns().T]).T
        angles = columns[:, 8:11]
        tracks.append(
            FingerTrack(one.times_s, one.joints, angles, np.nan * one.direction_rad, one.sigma)
        )
    found = choices([noisy._replace(tracks=tracks)], Noise(noise_mm / 90.1, 0.01), silent)
    assert not any("direction" in one.markers for one in found)
    every = next(one for one in found if len(one.markers) == 4)
    # DIP: 0.4 mm across 20.8 and 27.0 mm, but for what bones of known lengths make up for.
    assert every.predicted_deg[2] == pytest.approx(1.9, abs=0.4)
    # An instant between two frames is their mean, which has .6 to 1 of a frame's noise.
    ratios = np.array(every.found_deg[1:]) / every.predicted_deg[1:]
    assert ((ratios > 0.6) & (ratios < 1.1)).all()


def test_the_fewest_for_an_accuracy(made):
    ordered = sorted(made.values(), key=lambda one: (len(one.markers), one.worst_deg))
    assert len(fewest(ordered, 1.5).markers) == 3
    assert fewest(ordered, 0.001) is None
