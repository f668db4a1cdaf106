"""The compiled blobs are those of the Python form, and stay within what they are given."""

from __future__ import annotations

import ctypes
import dataclasses

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect import compiled_patches
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.search_region import whole
from services.pi_tracker.image.compiled_colors import InC, full_range_layers
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.planes import LIMITED_CHROMA, LIMITED_LUMA
from services.pi_tracker.image.yuv_planes import picture
from testing import synthetic_images

WIDTH, HEIGHT = 24, 17


def both(compiled, table, rounds=1, min_area_px=4):
    """A detector, and its compiled form whatever this process has loaded."""
    detector = BlobDetector(
        table, Tracker(erode=rounds, dilate=rounds, min_area_px=float(min_area_px))
    )
    return detector, compiled_patches.CompiledPatches(
        compiled,
        table.layers,
        margin=detector._margin,
        rounds=rounds,
        min_cells=detector._min_cells,
        most=64,
    )


def listed(blobs):
    """What tells blobs apart, in an order."""
    return sorted((blob._replace(mask=blob.mask.tolist()) for blob in blobs), key=lambda b: b.rect)


def assert_same(detector, compiled_form, image, rect):
    """Both forms find the same; returns whether the compiled one found it."""
    found = compiled_form(image.planes, rect)
    if found is None:
        return False
    expected = detector._detect_in_python(image, rect, keep_thin=False)
    assert listed(found.blobs) == listed(expected.blobs)
    assert found.cells == expected.cells
    return True


@pytest.mark.parametrize("seed", range(24))
def test_markers_of_random_pictures_are_the_same(studio, tip, colors, compiled, seed):
    """Tips of all sizes and shades, the edges of the picture among their places."""
    rng = np.random.default_rng(seed)
    size = (160, 120)
    tips = [
        tip(
            paint,
            *rng.uniform(0, size),
            rng.uniform(4, 22),
            length_px=rng.uniform(6, 30),
            turn_rad=rng.uniform(0, 6.3),
            light_rad=rng.uniform(-1, 1),
        )
        for paint in studio.paints
    ]
    bgr = studio.bgr(studio.clean(tips, size)[0], rng.uniform(0, 8), seed)
    image = picture(synthetic_images.frame_of(bgr, full_range=bool(seed % 2)))
    table = compile_colors(colors, list(studio.paints))
    for rounds in (0, 1, 2):
        detector, form = both(compiled, table, rounds)
        for rect in (whole(image.size), (5, 7, 70, 51)):
            assert_same(detector, form, image, rect)


def test_markers_apart_are_for_compiled_code(studio, tip, colors, compiled):
    names = list(studio.paints)[::2]
    tips = [tip(name, 30.0 + 40 * i, 40.0) for i, name in enumerate(names)]
    image = picture(studio.frame(tips, size_px=(150, 90), sigma=1.0)[0])
    detector, form = both(compiled, compile_colors(colors, names))
    assert assert_same(detector, form, image, whole(image.size))
    assert len(form(image.planes, whole(image.size)).blobs) == 3


def span(low, high):
    return ColorRange(hsv_low=low, hsv_high=high)


# Two that share chromas, so that there are two layers, and a third.
RANGES = {
    "light": span((100, 60, 160), (130, 255, 255)),
    "dark": span((100, 60, 40), (130, 255, 150)),
    "red": span((170, 60, 40), (10, 255, 255)),
}


@pytest.fixture(scope="module")
def table():
    return compile_colors(Colors(colors=RANGES), list(RANGES))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 1 << 30),
    rounds=st.integers(0, 3),
    share=st.floats(0, 1),
    min_area=st.integers(1, 60),
    full_range=st.booleans(),
    corner=st.tuples(st.integers(0, WIDTH - 1), st.integers(0, HEIGHT - 1)),
)
def test_any_levels_are_searched_alike(
    table, compiled, seed, rounds, share, min_area, full_range, corner
):
    """Runs of cells, single ones, all and none; to the edges, as rows run into each other."""
    rng = np.random.default_rng(seed)
    blue = rng.uniform(size=(HEIGHT, WIDTH)) < share
    if seed % 2:
        blue = cv2.blur(blue.astype(np.float32), (3, 3)) > 0.5
    levels = np.empty((3 * HEIGHT, 2 * WIDTH), np.uint8)
    levels[: 2 * HEIGHT] = rng.integers(60, 90 if seed % 3 else 200, (2 * HEIGHT, 2 * WIDTH))
    chroma = levels[2 * HEIGHT :].reshape(2, HEIGHT, WIDTH)
    chroma[0], chroma[1] = np.where(blue, 190, 128), np.where(blue, 110, 128)
    image = picture(Frame("left", 0, 0, 0.0, (2 * WIDTH, 2 * HEIGHT), levels, "i420", full_range))
    detector, form = both(compiled, table, rounds, min_area)
    assert len(table.layers) == 2
    assert_same(detector, form, image, (*corner, WIDTH, HEIGHT))


def test_a_patch_in_a_ring_is_left_to_python(table, compiled):
    """Contours are outer ones: what a ring holds is none of its own."""
    levels = np.full((3 * HEIGHT, 2 * WIDTH), 128, np.uint8)
    levels[: 2 * HEIGHT] = 80
    chroma = levels[2 * HEIGHT :].reshape(2, HEIGHT, WIDTH)
    chroma[0, 2:15, 2:20] = 190
    chroma[0, 4:13, 4:18] = 128
    chroma[0, 7:10, 9:12] = 190
    image = picture(Frame("left", 0, 0, 0.0, (2 * WIDTH, 2 * HEIGHT), levels, "i420"))
    detector, form = both(compiled, table)
    assert form(image.planes, whole(image.size)) is None
    assert len(detector.detect(image, whole(image.size))) == 1


def test_more_patches_than_there_is_room_for_are_left_to_python(table, compiled):
    levels = np.full((3 * HEIGHT, 2 * WIDTH), 128, np.uint8)
    levels[: 2 * HEIGHT] = 80
    levels[2 * HEIGHT :].reshape(2, HEIGHT, WIDTH)[0, ::2, ::2] = 190
    image = picture(Frame("left", 0, 0, 0.0, (2 * WIDTH, 2 * HEIGHT), levels, "i420"))
    _, form = both(compiled, table, rounds=0, min_area_px=1)
    assert form(image.planes, whole(image.size)) is None


def test_levels_of_full_range_have_the_classes_of_those_they_stand_for(table):
    rng = np.random.default_rng(0)
    luma = rng.integers(0, 256, (200, 300), dtype=np.uint8)
    chroma = rng.integers(0, 256, (200, 300, 2), dtype=np.uint8)
    expected = table.classify(LIMITED_LUMA[luma], LIMITED_CHROMA[chroma]).copy()
    layers = full_range_layers(np.array(table.layers))
    classes = np.zeros_like(luma)
    for layer in layers:
        entries = layer[chroma[..., 0] | chroma[..., 1].astype(np.int64) << 8]
        own, low, high = (entries >> shift & 255 for shift in (0, 8, 16))
        classes[(luma >= low) & (luma <= high)] = own[(luma >= low) & (luma <= high)]
    assert np.array_equal(classes, expected)
    assert set(np.unique(classes)) == {0, 1, 2, 3}


@pytest.mark.parametrize("beyond", [(-1, 0, 0, 0), (0, -1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)])
def test_a_rectangle_beyond_the_picture_is_refused(table, compiled, beyond):
    refused(table, compiled, tuple(np.add((0, 0, WIDTH, HEIGHT), beyond).tolist()))


def test_a_rectangle_of_no_cells_or_any_numbers_is_refused(table, compiled):
    for rect in ((3, 3, 3, 5), (5, 5, 3, 3), (-(2**31), 0, 2**31 - 1, 1)):
        refused(table, compiled, rect)


def refused(table, compiled, rect):
    """The compiled form says that there is no such rectangle."""
    levels = np.zeros((3 * HEIGHT, 2 * WIDTH), np.uint8)
    image = picture(Frame("left", 0, 0, 0.0, (2 * WIDTH, 2 * HEIGHT), levels, "i420"))
    _, form = both(compiled, table)
    with pytest.raises(ValueError, match=r"no such rectangle: \("):
        form(image.planes, rect)


def test_planes_smaller_than_the_picture_are_refused(table, compiled):
    levels = np.zeros((3 * HEIGHT, 2 * WIDTH), np.uint8)
    planes = picture(Frame("left", 0, 0, 0.0, (2 * WIDTH, 2 * HEIGHT), levels, "i420")).planes
    _, form = both(compiled, table)
    taller = (WIDTH, 2 * HEIGHT)
    with pytest.raises(ValueError, match="no such picture"):
        form(dataclasses.replace(planes, rect=(0, 0, *taller), size=taller), (0, 0, 3, 3))


def test_both_sides_have_the_same_structures(compiled):
    sizes = (ctypes.c_int32 * 3).in_dll(compiled, "rhot_patches_sizes")
    number = ctypes.sizeof(ctypes.c_int32)
    colors = ctypes.sizeof(InC)
    assert list(sizes) == [colors, 4 * number, compiled_patches._NUMBERS * number]
