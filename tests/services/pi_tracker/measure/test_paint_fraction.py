"""Paint fractions of cells that show paint and background, mixed as light."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.detect.search_region import whole
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import picture
from services.pi_tracker.measure import centroid
from services.pi_tracker.measure.paint_fraction import LinearLight, Mixture

# BT.601 from R, G, B, as cameras have it, and full range to the power of 1.5 for light, as
# paint_fraction.py has it.
YUV_FROM_RGB = np.linalg.inv([[1.164, 0.0, 1.596], [1.164, -0.392, -0.813], [1.164, 2.017, 0.0]])
SHAPE = (9, 2, 12)


def encoded(light):
    """Cells (4, h, n, w) of light (h, n, w, 3), R, G, B of 0..255."""
    yuv = (255.0 * (light / 255.0) ** (1 / 1.5)) @ YUV_FROM_RGB.T
    return np.concatenate([np.moveaxis(yuv, -1, 0), np.ones((1, *light.shape[:-1]))]).astype(
        np.float32
    )


@pytest.fixture
def fractions():
    """Bare to the left, painted to the right, and a slope between them."""
    ramp = np.clip((np.arange(SHAPE[2]) - 3) / 5.0, 0.0, 1.0)
    return np.broadcast_to(ramp, SHAPE).copy()


@pytest.fixture
def pure(fractions):
    """Weights of the cells that show one of both only."""
    return np.stack([fractions == 0.0, fractions == 1.0]).astype(np.float32)


@pytest.fixture
def mixed(fractions):
    """Blue paint before a wall four times brighter, once in full light and once in half of it."""
    paint, wall = np.array([20.0, 40.0, 90.0]), np.array([200.0, 190.0, 180.0])
    full_and_half = np.array([1.0, 0.5])[:, None, None]
    return (fractions[..., None] * paint + (1 - fractions[..., None]) * wall) * full_and_half


def test_a_known_mixture_is_recovered(fractions, pure, mixed):
    mixture = Mixture(LinearLight(encoded(mixed)), pure)
    fraction, _, variance = mixture.fraction(Noise())
    # Cells of the slope that are in reach of both; further away there is no more than the mean of
    # all, which here is as good.
    assert fraction == pytest.approx(fractions, abs=2e-3)
    assert mixture.shade_free_fraction() == pytest.approx(fractions, abs=2e-3)
    assert (variance > 0.0).all()


def test_shade_on_paint_and_background_alike_leaves_the_ratio(fractions, pure, mixed):
    # In the slope it is darker than where either is pure.
    between = ((fractions > 0.0) & (fractions < 1.0))[..., None]
    shaded = np.where(between, 0.6 * mixed, mixed)
    mixture = Mixture(LinearLight(encoded(shaded)), pure, rough=True)
    assert mixture.shade_free_fraction() == pytest.approx(fractions, abs=5e-3)


def test_slopes_are_the_derivatives_by_what_the_camera_says():
    rng = np.random.default_rng(1)
    cells = encoded(rng.uniform(20.0, 240.0, (*SHAPE, 3))).astype(np.float64)
    by_light = rng.normal(0.0, 1.0, (3, *SHAPE)).astype(np.float32)
    slopes = LinearLight(cells.astype(np.float32)).derivative_by_encoded(by_light)
    for channel in range(3):
        step = np.zeros_like(cells)
        step[channel] = 0.5
        above, below = (
            LinearLight((cells + sign * step).astype(np.float32)).cells[:3] for sign in (1, -1)
        )
        expected = np.sum(by_light * above, axis=0) - np.sum(by_light * below, axis=0)
        assert slopes[channel] == pytest.approx(expected, rel=0.01, abs=0.01)


def test_noise_of_the_fraction_is_as_told(fractions, pure, mixed):
    rng, cells, noise = np.random.default_rng(2), encoded(mixed), Noise(1.0, 0.7)
    clean = Mixture(LinearLight(cells), pure)
    told = np.sqrt(clean.fraction(noise).variance[:, :, 5:7])
    seen = []
    for _ in range(200):
        noisy = cells.copy()
        # Only where both are mixed: what is known of paint and background stays.
        noisy[:3, :, :, 5:7] += (
            rng.normal(0.0, 1.0, (3, *SHAPE[:2], 2))
            * np.array([1.0, 0.7, 0.7])[:, None, None, None]
        )
        seen.append(Mixture(LinearLight(noisy), pure).fraction(noise).fraction[:, :, 5:7])
    assert np.std(seen, axis=0).mean() == pytest.approx(told.mean(), rel=0.1)


class Grey:
    """Grey levels taken for light."""

    def __init__(self, cells):
        self.cells = cells
        self.rows = np.ascontiguousarray(cells.swapaxes(0, 1))

    @staticmethod
    def derivative_by_encoded(slopes):
        return slopes


def test_a_wall_of_two_colours_biases_less_than_in_grey_levels(studio, tip, detector, monkeypatch):
    # Bright to the left of every tip, dark to its right.
    wall = np.full((64, 64, 3), 60.0)
    wall[:, :32] = 205.0
    errors = {LinearLight: [], Grey: []}
    for number, name in enumerate([*studio.paints] * 2):
        x = 31.6 + 0.07 * number
        frame, truth = studio.frame(
            [tip(name, x, 32.0, turn_rad=1.57)], seq=number, sigma=1.0, shading=0.0, wall=wall
        )
        image = picture(frame)
        for light, found in errors.items():
            monkeypatch.setattr(centroid, "LinearLight", light)
            blobs = [
                blob
                for blob in detector.detect(image, whole(image.size))
                if detector.names[blob.color] == name
            ]
            (one,) = centroid.centroids(image, blobs, Noise(0.4, 0.4))
            found.append(one.x_px - truth[name][0])
    light, grey = (float(np.sqrt(np.mean(np.square(found)))) for found in errors.values())
    # .19 px, as a camera's power is 2.2 and not 1.5, and .38.
    assert light < 0.22
    assert grey > 1.8 * light


@pytest.mark.parametrize("level", [-16.0, 0.0, 239.0])
@pytest.mark.parametrize("chroma", [-128.0, 0.0, 127.0])
@pytest.mark.parametrize("known", [0.0, 1.0])
def test_dark_and_saturated_cells_stay_finite(level, chroma, known):
    cells = np.ones((4, *SHAPE), np.float32)
    cells[0], cells[1:3] = level, chroma
    mixture = Mixture(LinearLight(cells), np.full((2, *SHAPE), known, np.float32))
    for values in (*mixture.fraction(Noise()), mixture.contrast(), mixture.shade_free_fraction()):
        assert np.isfinite(values).all()
    assert (mixture.shade_free_fraction() >= 0.0).all()
    assert (mixture.shade_free_fraction() <= 1.0).all()
