"""Sensor noise: its strength, and which part of the bank a frame takes."""

from __future__ import annotations

import numpy as np
import pytest

from services.simulator.render.noise import NOISE_UNIT, noise_bank, noise_offsets


def test_noise_of_each_colour_channel_has_unit_strength():
    luma, chroma = noise_bank(480, 640, seed=3)
    assert luma.shape == (608, 768)
    assert chroma.shape == (2, 304, 384)
    assert luma.std() / NOISE_UNIT == pytest.approx(0.574, rel=0.12)
    # A camera's noise has neighbours: demosaicing smears it.
    y = luma.astype(float)
    assert np.corrcoef(y[:, :-2].ravel(), y[:, 2:].ravel())[0, 1] > 0.02


def test_noise_offsets_are_even_and_inside_the_bank():
    offsets = {noise_offsets(1, frame) for frame in range(500)}
    assert len(offsets) > 400
    assert all(r % 2 == c % 2 == 0 and 0 <= r < 128 and 0 <= c < 128 for r, c in offsets)
