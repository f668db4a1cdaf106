"""From light to a picture: blur, gamma, averaged chroma."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from services.simulator.render import develop
from services.simulator.render.noise import NoiseBank, NoiseDraw, add_noise

EVERYTHING = np.tile([0, 47], (32, 1))


def developed(light: np.ndarray) -> develop.Planes:
    planes = develop.empty_planes(48, 32)
    develop.to_yuv420(EVERYTHING, develop.tone_curve(), light.astype(np.float32), planes)
    return planes


def test_chroma_is_the_mean_of_four_pixels():
    rng = np.random.default_rng(1)
    light = rng.uniform(0.0, 1.0, (32, 48, 3))
    luma, chroma = developed(light)
    grey = 255.0 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    r, g, b = grey[..., 0], grey[..., 1], grey[..., 2]
    np.testing.assert_allclose(luma, 16 + 0.257 * r + 0.504 * g + 0.098 * b, atol=0.3)
    for plane, full in zip(
        chroma, (-0.148 * r - 0.291 * g + 0.439 * b, 0.439 * r - 0.368 * g - 0.071 * b), strict=True
    ):
        mean = 128 + full.reshape(16, 2, 24, 2).mean(axis=(1, 3))
        np.testing.assert_allclose(plane, mean, atol=0.3)
        # What OpenCV would take instead, one pixel of the four, is far from it.
        assert np.abs(128 + full[::2, ::2] - mean).max() > 10.0


def test_colours_come_back_through_opencv():
    for linear in ((0.5, 0.1, 0.05), (0.02, 0.4, 0.1), (0.9, 0.9, 0.9), (0.0, 0.0, 0.0)):
        planes = developed(np.broadcast_to(linear, (32, 48, 3)))
        out = np.empty((48, 48), np.uint8)
        bank = NoiseBank(np.zeros((160, 176), np.int8), np.zeros((2, 80, 88), np.int8))
        add_noise(planes, bank, NoiseDraw(0, 0, 1.0, 0.0), out)
        bgr = cv2.cvtColor(out, cv2.COLOR_YUV2BGR_I420)
        grey = [
            255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055)
            for v in reversed(linear)
        ]
        np.testing.assert_allclose(bgr[16, 24], grey, atol=3.0)


@pytest.mark.parametrize("sigma_px", [0.6, 0.8])
def test_blur_has_the_width_it_says_and_keeps_the_light(sigma_px):
    picture = np.zeros((32, 48, 3), np.float32)
    picture[16, 24] = 1.0
    out, scratch = np.zeros_like(picture), np.zeros_like(picture)
    develop.blur(EVERYTHING, develop.blur_weights(sigma_px), picture, scratch, out)
    spot = out[..., 1]
    assert spot.sum() == pytest.approx(1.0, abs=1e-5)
    x = np.arange(48) - 24.0
    assert np.sqrt((spot.sum(axis=0) * x**2).sum()) == pytest.approx(sigma_px, rel=0.05)


def test_blur_of_a_part_equals_the_blur_of_everything():
    picture = np.random.default_rng(2).random((32, 48, 3)).astype(np.float32)
    weights = develop.blur_weights(0.7)
    full, part = np.zeros_like(picture), np.zeros_like(picture)
    develop.blur(EVERYTHING, weights, picture, np.zeros_like(picture), full)
    some = np.tile([1 << 30, -1], (32, 1))
    some[8:22] = (10, 33)
    develop.blur(some, weights, picture, np.zeros_like(picture), part)
    np.testing.assert_array_equal(part[8:22, 10:34], full[8:22, 10:34])
