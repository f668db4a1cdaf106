"""Slivers of dots that turn away: found near where a dot was, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.dots.patches.slivers import SliverFinder
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import Picture, picture
from testing.dot_pictures import COLORS, SIZE

TABLE = compile_colors(COLORS, ["red", "blue"])
RED = TABLE.names.index("red")
AREA_PX2 = 180.0  # of a dot that shows as a whole: 15 px wide
BGR = {"red": (35, 25, 190), "blue": (180, 60, 20)}
# Left, top, right, bottom of what is one cell wide and six high, px.
SLIVER = (200, 140, 202, 152)
MIDDLE = (200.5, 145.5)


def _picture(*bars: tuple[int, int, int, int], color: str = "red") -> Picture:
    image: Image = np.full((SIZE[1], SIZE[0], 3), (110, 140, 200), np.uint8)
    for left, top, right, bottom in bars:
        image[top:bottom, left:right] = BGR[color]
    return picture(Frame("side", 0, 0, 0.0, SIZE, image, "bgr"))


def _found(image: Picture) -> list[Blob]:
    detector = BlobDetector(TABLE, Tracker())
    return detector.detect(image, search_region.whole(image.size))


def _slivers(
    image: Picture, *dots_px: tuple[float, float], area_px2: float = AREA_PX2
) -> list[tuple[float, float]]:
    finder = SliverFinder(TABLE, RED, Tracker())
    return [(one.x_px, one.y_px) for one in finder.beside(_found(image), image, dots_px, area_px2)]


@pytest.mark.parametrize("away_px", [0.0, 12.0, 28.0])
def test_a_sliver_near_a_dot_is_found(away_px: float) -> None:
    image = _picture(SLIVER)
    assert _found(image) == [], "a plain search takes it for noise"
    dot = (MIDDLE[0] + away_px, MIDDLE[1])
    assert _slivers(image, (500.0, 300.0), dot) == [pytest.approx(MIDDLE)]


def test_a_sliver_far_from_all_dots_is_not_found() -> None:
    """Expected: two diameters of a dot are 30 px."""
    assert _slivers(_picture(SLIVER), (235.0, 145.5), (500.0, 300.0)) == []


def test_a_sliver_beside_a_patch_is_that_patchs() -> None:
    """Expected: a cell apart it is its edge; further away it is another dot's."""
    patch = (204, 140, 218, 154)
    assert len(_found(_picture(SLIVER, patch))) == 1
    assert _slivers(_picture(SLIVER, patch), MIDDLE) == []
    patch = (210, 140, 224, 154)
    assert _slivers(_picture(SLIVER, patch), MIDDLE) == [pytest.approx(MIDDLE)]


def test_noise_of_a_cell_or_two_is_no_sliver() -> None:
    """Expected: less than a twentieth of a dot, which is 9 px^2, is none."""
    assert _slivers(_picture((200, 140, 202, 144)), MIDDLE) == []
    assert len(_slivers(_picture((200, 140, 202, 146)), MIDDLE)) == 1


def test_what_is_no_dots_shape_or_colour_is_no_sliver() -> None:
    assert _slivers(_picture((200, 120, 202, 170)), MIDDLE) == [], "a line is not paint"
    assert _slivers(_picture(SLIVER, color="blue"), MIDDLE) == []


def test_nothing_is_found_where_nothing_is_known_of_dots() -> None:
    assert _slivers(_picture(SLIVER)) == []
    assert _slivers(_picture(SLIVER), MIDDLE, area_px2=0.0) == []
