"""A picture fills the scene, above the panel on a phone: clicks come back to its pixels."""

from __future__ import annotations

import numpy as np
import pytest

from services.viewer.calibration.placing import placed

PICTURE = np.zeros((480, 640, 3), np.uint8)
PICTURE[100:140, 300:360] = 255


@pytest.mark.parametrize("window_px", [(1280, 800), (390, 844), (2560, 1440), (700, 300), (0, 0)])
def test_what_is_seen_at_a_place_is_that_place_of_the_picture(window_px: tuple[int, int]) -> None:
    canvas, place = placed(PICTURE, window_px)
    rows, columns = np.nonzero(canvas[..., 0] > 250)
    at = ((columns.mean() + 0.5) / canvas.shape[1], (rows.mean() + 0.5) / canvas.shape[0])
    x, y = place.in_picture(*at)
    assert (640 * x, 480 * y) == pytest.approx((330.0, 120.0), abs=2.0)
    assert max(canvas.shape) <= 1600


def test_it_fills_the_window_and_on_a_phone_what_is_above_the_panel() -> None:
    _, wide = placed(PICTURE, (880, 800))
    assert wide.width > 0.9
    _, narrow = placed(PICTURE, (390, 844))
    assert narrow.top + narrow.height < 0.45
    assert narrow.width > 0.9


def test_beside_the_picture_is_outside_of_it() -> None:
    _, place = placed(PICTURE, (1280, 800))
    x, _ = place.in_picture(0.99, 0.5)
    assert x > 1.0
