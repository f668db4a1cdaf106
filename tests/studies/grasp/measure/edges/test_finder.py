"""A plain rendered finger, followed by its edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.measure.edges.finder import EdgeFinder
from studies.grasp.measure.edges.segments import edges_near
from studies.grasp.measure.recordings import Wanted, recordings
from studies.grasp.scene.experiment import Experiment
from studies.grasp.scene.motion import Cycles
from studies.grasp.scene.subjects import SUBJECTS
from studies.grasp.scene.truth import truth_of
from testing.grasp_pictures import frame_of

PICTURES = 8


@pytest.fixture(scope="module")
def plain(pinch_options):
    """The first half of a slow closing: experiment, frames, seeds."""
    options = pinch_options._replace(dots=None, thumb=False, cycles=Cycles(1, 3.0, 16.0, sway=0.3))
    experiment = Experiment(SUBJECTS[0], options, 23)
    frames = [frame_of(experiment.picture(number), number) for number in range(PICTURES)]
    at = experiment.pixels_of(0)
    seeds = {f"index_{name}": tuple(at[name].tolist()) for name in ("mcp", "pip", "dip", "tip")}
    seeds["index_b1"] = tuple(at["base"].tolist())
    seeds["index_b2"] = tuple((0.2 * at["base"] + 0.8 * at["mcp"]).tolist())
    return experiment, frames, seeds


@pytest.mark.parametrize(("paper", "worst_deg", "share"), [(False, 5.0, 0.9), (True, 12.0, 0.3)])
def test_angles_of_a_plain_finger(plain, paper, worst_deg, share):
    experiment, frames, seeds = plain
    finder = EdgeFinder("index", seeds, paper=paper)
    seen = [finder.find(frame) for frame in frames]
    method = "edges-paper" if paper else "edges"
    recording = recordings(seen, list(seeds), Wanted(), method, {})["index"].recording
    assert ("the paper's regions" in " ".join(recording.notes)) == paper
    errors = []
    for frame, true in zip(recording.frames, truth_of(experiment)[0].frames, strict=False):
        errors += [frame.angles_rad[joint] - true.angles_rad[joint] for joint in frame.angles_rad]
    assert len(errors) >= share * 3 * PICTURES
    assert np.degrees(np.sqrt(np.mean(np.square(errors)))) < worst_deg


def test_no_finger_and_seeds_beside_it(plain):
    _, frames, seeds = plain
    empty = replace(frames[0], image=np.full_like(frames[0].image, 150))
    with pytest.raises(CaptureError, match="no finger is seen"):
        EdgeFinder("index", seeds).find(empty)
    aside = {place: (x, y - 90.0) for place, (x, y) in seeds.items()}
    with pytest.raises(CaptureError, match="seeds index_mcp and index_pip"):
        EdgeFinder("index", aside).find(frames[0])


def test_a_finger_that_vanishes_is_told(plain):
    _, frames, seeds = plain
    finder = EdgeFinder("index", seeds)
    finder.find(frames[0])
    seen = finder.find(replace(frames[1], image=np.full_like(frames[1].image, 150)))
    assert set(seen.lost) == {"index_mcp", "index_pip", "index_dip", "index_tip"}
    assert "its outline is hidden" in seen.lost["index_tip"]


def test_edges_of_nothing():
    flat = np.full((60, 80), 90, np.uint8)
    assert len(edges_near(flat, np.array([(20.0, 20.0), (60.0, 30.0)]), 10.0).points) == 0
    assert len(edges_near(flat, np.array([(200.0, 20.0), (210.0, 30.0)]), 10.0).points) == 0
