"""Blobs that may be paint by their shape."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.identify.blob_shape import is_paint_shaped, may_be_rim, touch
from testing.synthetic_blobs import filled_blob, square_blob


def test_shapes_that_no_patch_of_paint_has():
    assert is_paint_shaped(square_blob(0, 50, 50), 20_000.0)
    assert not is_paint_shaped(square_blob(0, 50, 50, 200), 20_000.0)
    stripe = filled_blob(0, (0, 0, 40, 2))
    cross = filled_blob(0, (0, 0, 40, 40), np.eye(40, dtype=np.uint8))
    assert not is_paint_shaped(stripe, 20_000.0)
    assert not is_paint_shaped(cross, 20_000.0)


def test_a_rim_is_smaller_than_what_it_touches():
    large, small = filled_blob(0, (10, 10, 20, 20)), filled_blob(1, (20, 12, 22, 18))
    assert may_be_rim(small, large)
    assert not may_be_rim(large, small)
    # As wide as long: a tip before a thing.
    assert not may_be_rim(filled_blob(1, (20, 12, 25, 18)), large)
    assert not may_be_rim(filled_blob(1, (23, 12, 25, 18)), large)
    assert touch((0, 0, 4, 4), (5, 5, 8, 8))
    assert not touch((0, 0, 4, 4), (6, 0, 8, 4))
