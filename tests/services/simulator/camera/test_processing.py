"""A Pi's sharpening and denoising, as modelled; and pictures in full range."""

from __future__ import annotations

import cv2
import msgspec
import numpy as np
import pytest

from rhot.files.simulator_table import Simulator
from services.simulator.camera.frame_source import FrameSource
from services.simulator.camera.processing import processed
from services.simulator.render.renderer import Renderer
from services.simulator.scene.scene import load_scene

SHARPENED, DENOISED = Simulator(sharpen=1.0), Simulator(denoise=0.75)
NOISE = 5.0


@pytest.fixture
def edge() -> np.ndarray:
    """An edge of 80 grey levels and of chroma, blurred as a lens does, without noise."""
    luma = np.full((64, 64), 80.0, np.float32)
    luma[:, 32:] = 160.0
    u = np.full((32, 32), 110.0, np.float32)
    u[:, 16:] = 150.0
    planes = [cv2.GaussianBlur(plane, (0, 0), 0.8) for plane in (luma, u, 256.0 - u)]
    flat = np.concatenate([plane.ravel() for plane in planes])
    return np.rint(flat).astype(np.uint8).reshape(96, 64)


def noisy(image: np.ndarray, seed: int) -> np.ndarray:
    """With the noise that NOISE levels in each colour channel make of luma and chroma."""
    rng = np.random.default_rng(seed)
    sigma = np.full(image.shape, 0.57 * NOISE)
    sigma[64:] = 0.45 * NOISE
    return np.clip(np.rint(image + sigma * rng.standard_normal(image.shape)), 0, 255).astype(
        np.uint8
    )


def flat_parts(image: np.ndarray) -> list[np.ndarray]:
    """Luma and chroma U of the even surface left of the edge."""
    return [image[:64, :20], image[64:].reshape(2, 32, 32)[0, :, :10]]


def test_nothing_asked_for_changes_nothing(edge):
    assert processed(edge, NOISE, Simulator()) is edge


def test_sharpening_overshoots_at_edges_of_luma_only(edge):
    out = processed(edge, NOISE, SHARPENED)
    assert out.shape == edge.shape
    assert out[32, 32:40].max() > 165
    assert out[32, 24:32].min() < 75
    # Away from edges nothing happens, and chroma is not sharpened at all.
    assert np.array_equal(out[:64, :20], edge[:64, :20])
    assert np.array_equal(out[64:], edge[64:])
    twice = processed(edge, NOISE, Simulator(sharpen=4.0))
    assert out[:64].max() < twice[:64].max() <= 160 + 64


def test_denoising_smooths_noise_and_keeps_edges(edge):
    picture = noisy(edge, 1)
    out = processed(picture, NOISE, DENOISED)
    for before, after in zip(flat_parts(picture), flat_parts(out), strict=True):
        assert after.std() < 0.75 * before.std()
    step = out[:64, 40:].mean() - out[:64, :24].mean()
    assert step == pytest.approx(80.0, abs=1.0)
    # The edge is as steep as it was.
    steep = np.diff(out[:64].mean(axis=0)).max()
    assert steep > 0.9 * np.diff(picture[:64].mean(axis=0)).max()


def test_the_simulator_processes_as_rig_toml_says(config, fist, renderer):
    settings = msgspec.structs.replace(config.simulator, sharpen=1.0, denoise=0.75)
    changed = msgspec.structs.replace(config, simulator=settings)
    source = FrameSource(load_scene(changed, "fist", seed=1), "left")
    plain = renderer.picture(5)
    expected = processed(plain, fist.spec.noise, settings)
    assert np.array_equal(source.take(5).image, expected)
    assert np.mean(expected != plain) > 0.2


def test_a_picture_in_full_range_shows_the_same(config, fist, renderer, planes):
    wide = Renderer(fist, "left", full_range=True)
    for limited, full in (
        (renderer.picture(5), wide.picture(5)),
        (renderer.clean(0.4), wide.clean(0.4)),
    ):
        y, u, v = planes(limited)
        wide_y, wide_u, wide_v = planes(full)
        np.testing.assert_allclose(wide_y, np.clip((y - 16) * 255 / 219, 0, 255), atol=1.6)
        for a, b in ((u, wide_u), (v, wide_v)):
            np.testing.assert_allclose(b, 128 + (a - 128) * 255 / 224, atol=1.6)


def test_live_frames_say_their_range_and_captures_are_limited(config):
    settings = msgspec.structs.replace(config.simulator, full_range=True)
    scene = load_scene(msgspec.structs.replace(config, simulator=settings), "fist", seed=1)
    live, recorded = FrameSource(scene, "left"), FrameSource(scene, "left", recorded=True)
    assert (live.take(3).full_range, recorded.take(3).full_range) == (True, False)
    assert not FrameSource(load_scene(config, "fist", seed=1), "left").take(3).full_range


def test_jpeg_leaves_the_picture_but_for_what_it_cannot_code(edge):
    image = noisy(edge, 1)
    fine, coarse = (processed(image, NOISE, Simulator(jpeg=quality)) for quality in (98, 40))
    off = [np.abs(coded.astype(int) - image).mean() for coded in (fine, coarse)]
    assert fine.shape == image.shape
    assert 0.0 < off[0] < 1.0 < off[1] < 8.0
    # Means stay: colours are not shifted.
    for one, other in zip(flat_parts(image), flat_parts(coarse), strict=True):
        assert one.mean() == pytest.approx(other.mean(), abs=1.5)
