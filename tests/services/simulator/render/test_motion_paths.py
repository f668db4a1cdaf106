"""Paths of capsules during a frame."""

from __future__ import annotations

import numpy as np

from services.simulator.render.motion_paths import find_columns, find_rows, fit_parabola


def test_parabolas_meet_their_three_instants():
    at = np.random.default_rng(5).normal(size=(3, 4))
    out = np.empty((3, 4))
    fit_parabola(at[0], at[1], at[2], out)
    for u, value in zip((-1.0, 0.0, 1.0), at, strict=True):
        np.testing.assert_allclose(out[0] + u * out[1] + u * u * out[2], value, atol=1e-12)


def test_rows_and_columns_bound_what_is_drawn():
    tracks = np.zeros((1, 2, 3, 3))
    tracks[0, 0, 0], tracks[0, 1, 0] = (100.0, 50.0, 10.0), (200.0, 90.0, 6.0)
    spans = np.empty((1, 2), np.int64)
    find_rows(tracks, 480, spans)
    assert spans[0, 0] <= 40
    assert 96 <= spans[0, 1] <= 105
    first, last = find_columns(tracks[0], 0.0, 70, 640)
    assert first < 125
    assert last > 175
    assert find_columns(tracks[0], 0.0, 20, 640) == (0, -1)
    # Far outside the picture nothing is left.
    tracks[0, :, 0, 0] += 2000.0
    low, high = find_columns(tracks[0], 0.0, 70, 640)
    assert high < low
