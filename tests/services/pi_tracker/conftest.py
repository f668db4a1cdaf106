"""A studio that takes pictures with a known truth (services/pi_tracker/synthetic.py)."""

from __future__ import annotations

import pytest

from rhot.calibration import Colors
from rhot.config import Tracker
from services.pi_tracker import synthetic
from services.pi_tracker.colors import compile_colors
from services.pi_tracker.noise import Noise
from services.pi_tracker.search import Searcher


class Studio:
    """Takes pictures of finger tips."""

    paints = synthetic.PAINTS
    clean = staticmethod(synthetic.clean)
    bgr = staticmethod(synthetic.noisy)
    of = staticmethod(synthetic.frame_of)

    @staticmethod
    def frame(tips, seq=0, layout="i420", sigma=5.0, size_px=(64, 64), **look):
        """A noisy frame and the truth."""
        image, truth = synthetic.clean(tips, size_px, **look)
        return synthetic.frame_of(synthetic.noisy(image, sigma, seq), seq, layout), truth


@pytest.fixture(scope="session")
def studio() -> Studio:
    """Makes pictures."""
    return Studio()


@pytest.fixture(scope="session")
def tip() -> type[synthetic.Tip]:
    """The class of painted finger tips."""
    return synthetic.Tip


@pytest.fixture(scope="session")
def colors() -> Colors:
    """Ranges of all paints."""
    return synthetic.ranges()


@pytest.fixture
def searcher(colors) -> Searcher:
    """A searcher for all paints, in the order of PAINTS, with the default settings."""
    return Searcher(compile_colors(colors, list(synthetic.PAINTS)), Tracker())


@pytest.fixture
def noise() -> Noise:
    """Noise of cells where pixels have 5 grey levels."""
    return Noise(1.44, 1.47)
