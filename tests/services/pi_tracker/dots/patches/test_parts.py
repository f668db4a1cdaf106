"""Blobs that dots have run together into are cut; single dots are not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from services.pi_tracker.dots.patches.parts import parts_of
from services.pi_tracker.image.blob import Blob, blobs_of_contours, external_contours

RADIUS = 5  # cells
AREA = 4.0 * np.pi * RADIUS**2


def _blob(*centres: tuple[int, int]) -> Blob:
    mask = np.zeros((60, 80), np.uint8)
    for centre in centres:
        cv2.circle(mask, centre, RADIUS, 1, -1)
    (blob,) = blobs_of_contours(external_contours(mask), mask, 0, (0, 0), 1)
    return blob


def test_one_dot_is_one_part_whatever_it_measures() -> None:
    for area in (0.0, 0.5 * AREA, AREA):
        assert len(parts_of(_blob((40, 30)), area)) == 1


@pytest.mark.parametrize("apart", [7, 9, 10])
def test_two_dots_that_touch_or_overlap_are_two_parts_in_their_places(apart: int) -> None:
    parts = sorted(parts_of(_blob((30, 30), (30 + apart, 30)), AREA))
    assert len(parts) == 2
    for (x, y, area), column in zip(parts, (30, 30 + apart), strict=True):
        assert x == pytest.approx(2 * column + 0.5, abs=4.0)
        assert y == pytest.approx(60.5, abs=1.0)
        assert area == pytest.approx(AREA, rel=0.3)


def test_two_dots_nearer_to_the_camera_than_the_others_are_two() -> None:
    for apart in (9, 10):
        parts = parts_of(_blob((30, 30), (30 + apart, 30)), 0.7 * AREA)
        assert len(parts) == 2


def test_three_in_a_row_are_three() -> None:
    parts = sorted(parts_of(_blob((20, 20), (29, 24), (38, 28)), AREA))
    assert [round(x / 2) for x, _, _ in parts] == pytest.approx([20, 29, 38], abs=2)


def test_one_dot_nearer_to_the_camera_stays_whole() -> None:
    assert len(parts_of(_blob((40, 30)), 0.6 * AREA)) == 1


def test_a_few_cells_of_one_dot_are_no_crowd() -> None:
    """Expected: of few cells no part is round, but none is less than half a dot."""
    mask = np.zeros((20, 20), np.uint8)
    mask[5:8, 4:10] = 1  # 18 cells, 72 px^2
    (blob,) = blobs_of_contours(external_contours(mask), mask, 0, (0, 0), 1)
    for area in (30.0, 40.0, 50.0):
        parts = parts_of(blob, area)
        assert len(parts) <= 72.0 / (0.5 * area)
    assert len(parts_of(blob, 60.0)) == 1
