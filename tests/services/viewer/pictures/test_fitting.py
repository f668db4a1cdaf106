"""A picture in a window of any shape: whole, unscaled, and clicks are where they were made."""

from __future__ import annotations

import numpy as np
import pytest

from services.viewer.pictures.fitting import fitted


@pytest.mark.parametrize("aspect", [880 / 800, 390 / 844, 4 / 3, 3.0, 0.2])
@pytest.mark.parametrize("size", [(640, 480), (320, 240), (480, 640), (31, 17)])
def test_every_pixel_is_there_and_is_found_again(aspect: float, size: tuple[int, int]) -> None:
    width, height = size
    rgb = np.random.default_rng(1).integers(0, 200, (height, width, 3), np.uint8)
    made = fitted(rgb, aspect)
    whole_height, whole_width = made.rgb.shape[:2]
    # As near to the window's shape as whole pixels come.
    assert abs(whole_width - aspect * whole_height) <= 0.5 * max(1.0, aspect) + 1e-9
    for row, column in ((0, 0), (height - 1, width - 1), (height // 2, width // 3)):
        left, top, right, bottom = made.box
        x = left + (column + 0.5) / width * (right - left)
        y = top + (row + 0.5) / height * (bottom - top)
        at = made.rgb[int(y * whole_height), int(x * whole_width)]
        np.testing.assert_array_equal(at, rgb[row, column])
        assert made.inside(x, y) == pytest.approx(((column + 0.5) / width, (row + 0.5) / height))


def test_what_is_beside_the_picture_is_no_place_in_it() -> None:
    made = fitted(np.zeros((100, 100, 3), np.uint8), 2.0)
    assert made.inside(0.1, 0.5) is None
    assert made.inside(0.9, 0.5) is None
    assert made.inside(0.5, 0.5) == pytest.approx((0.5, 0.5))
    assert made.rgb[50, 10].tolist() == [245, 245, 245]


def test_in_an_upright_window_it_lies_at_the_top() -> None:
    assert fitted(np.zeros((480, 640, 3), np.uint8), 390 / 844).box[1] == 0.0
