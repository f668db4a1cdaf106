"""The first half of a slow closing of a plain finger, rendered once."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.measure.recordings import Wanted, recordings
from studies.grasp.scene.experiment import Experiment
from studies.grasp.scene.motion import Cycles
from studies.grasp.scene.subjects import SUBJECTS
from studies.grasp.scene.truth import truth_of
from testing.grasp_pictures import frame_of

PICTURES = 8


@pytest.fixture(scope="session")
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


@pytest.fixture(scope="session")
def angle_errors():
    """Of what was seen of an experiment, degrees, of all joints and pictures; and the recording."""

    def errors(experiment, seen, seeds, method):
        recording = recordings(seen, list(seeds), Wanted(), method, {})["index"].recording
        errors = [
            frame.angles_rad[joint] - true.angles_rad[joint]
            for frame, true in zip(recording.frames, truth_of(experiment)[0].frames, strict=False)
            for joint in frame.angles_rad
        ]
        return np.degrees(errors), recording

    return errors
