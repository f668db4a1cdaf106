"""A plain rendered finger, measured the paper's way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from studies.grasp.measure.edges.paper import PaperFinder


def test_angles_at_the_centroids_of_the_papers_regions(plain, angle_errors):
    experiment, frames, seeds = plain
    finder = PaperFinder("index", seeds)
    seen = [finder.find(frame) for frame in frames]
    errors, recording = angle_errors(experiment, seen, seeds, "edges-paper")
    assert "the paper's regions" in " ".join(recording.notes)
    assert len(errors) >= 0.3 * 3 * len(frames)
    assert np.sqrt(np.mean(np.square(errors))) < 12.0


def test_a_finger_that_vanishes_is_told(plain):
    _, frames, seeds = plain
    finder = PaperFinder("index", seeds)
    finder.find(frames[0])
    seen = finder.find(replace(frames[1], image=np.full_like(frames[1].image, 150)))
    assert set(seen.lost) == {"index_mcp", "index_pip", "index_dip", "index_tip"}
    assert "its outline is hidden" in seen.lost["index_tip"]
