"""Pictures with known ground truth (testing/synthetic_images.py), and what detects in them."""

from __future__ import annotations

import ctypes
import platform
from pathlib import Path

import pytest

from hatch_build import compile_for
from rhot.files.calibration import Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.image.noise import Noise
from testing import synthetic_images


class Studio:
    """Takes pictures of finger tips."""

    paints = synthetic_images.PAINTS
    clean = staticmethod(synthetic_images.clean)
    bgr = staticmethod(synthetic_images.noisy)
    of = staticmethod(synthetic_images.frame_of)

    @staticmethod
    def frame(tips, seq=0, layout="i420", sigma=5.0, size_px=(64, 64), **options):
        """A noisy frame and the ground truth."""
        image, truth = synthetic_images.clean(tips, size_px, **options)
        return synthetic_images.frame_of(
            synthetic_images.noisy(image, sigma, seq), seq, layout
        ), truth


@pytest.fixture(scope="session")
def studio() -> Studio:
    """Makes pictures."""
    return Studio()


@pytest.fixture(scope="session")
def tip() -> type[synthetic_images.Tip]:
    """The class of painted finger tips."""
    return synthetic_images.Tip


@pytest.fixture(scope="session")
def colors() -> Colors:
    """Ranges of all paints."""
    return synthetic_images.ranges()


@pytest.fixture(scope="session")
def compiled_file(tmp_path_factory) -> Path:
    """The tracker's C, compiled from the sources as they are."""
    path = tmp_path_factory.mktemp("compiled") / "tracker.so"
    if wrong := compile_for(platform.machine(), path):
        pytest.skip(f"the compiler {wrong}")
    return path


@pytest.fixture(scope="session")
def compiled(compiled_file) -> ctypes.CDLL:
    """The same, loaded."""
    return ctypes.CDLL(str(compiled_file))


@pytest.fixture
def detector(colors) -> BlobDetector:
    """A detector for all paints, in the order of PAINTS, with the default settings."""
    return BlobDetector(compile_colors(colors, list(synthetic_images.PAINTS)), Tracker())


@pytest.fixture
def noise() -> Noise:
    """Noise of cells where pixels have 5 grey levels."""
    return Noise(1.44, 1.47)
