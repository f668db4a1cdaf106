"""A rendered pinch, small and short, with dots: pictures, lens, truth. Rendered once a session."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.scene.experiment import Experiment, Options
from studies.grasp.scene.motion import Cycles
from studies.grasp.scene.subjects import SUBJECTS
from studies.grasp.scene.view import ViewOptions
from testing.grasp_pictures import frame_of

# A lens as good as none, and a camera that stands straight: what is left are the dots.
VIEW = ViewOptions(size_px=(480, 360), k1=0.0, k2=0.0, tilt_deg=2.0)


@pytest.fixture(scope="session")
def pinch_options():
    """A small picture, a quick pinch, eight green dots."""
    return Options(view=VIEW, cycles=Cycles(1, 0.9, 12.0), dots="green", thumb=True)


@pytest.fixture(scope="session")
def pinch(pinch_options):
    """Experiment and pictures of subject 1."""
    experiment = Experiment(SUBJECTS[0], pinch_options, 21)
    pictures = [experiment.picture(number) for number in range(len(experiment))]
    return experiment, [frame_of(picture, k) for k, picture in enumerate(pictures)]


@pytest.fixture(scope="session")
def pinch_seeds(pinch):
    """The eight dots' places in the first picture, a click's pixels off."""
    experiment, _ = pinch
    rng = np.random.default_rng(3)
    pixels = experiment.pixels_of(0)
    return {
        name if name.startswith("thumb") else f"index_{name}": tuple(
            (at + rng.uniform(-2.0, 2.0, 2)).tolist()
        )
        for name, at in pixels.items()
        if name != "base"
    }
