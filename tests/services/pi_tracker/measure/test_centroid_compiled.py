"""The compiled centroids are those of the Python form, and stay within what they are given."""

from __future__ import annotations

import ctypes
import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.near_colors import near_colors
from services.pi_tracker.detect.search_region import whole
from services.pi_tracker.image.blob import make_blob
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.planes import PICTURE_IN_C
from services.pi_tracker.image.yuv_planes import picture
from services.pi_tracker.measure import centroid_compiled, fastest
from services.pi_tracker.measure.centroid import centroids
from services.pi_tracker.measure.grown_blob import Growth, Limit, NearPaint, grown, limit
from testing import synthetic_images

# Cells of the pictures of random levels.
WIDTH, HEIGHT = 20, 14


@pytest.fixture(scope="module")
def measure(compiled):
    return centroid_compiled.CompiledCentroids(compiled)


def agree(found, expected):
    """To rounding.

    Where nothing is known better than to a pixel, both divide small differences of large numbers.
    """
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        unsure = other.sigma_px > 1.0
        tolerance = 1e-3 * other.sigma_px if unsure else 1e-4
        assert (one.x_px, one.y_px) == pytest.approx((other.x_px, other.y_px), abs=tolerance)
        assert one.area_px == pytest.approx(other.area_px, rel=1e-2 if unsure else 1e-4, abs=1e-3)
        assert one.sigma_px == pytest.approx(other.sigma_px, rel=3e-2 if unsure else 1e-3)
        assert one.quality == pytest.approx(other.quality, rel=1e-3 if unsure else 1e-4, abs=1e-6)


@pytest.mark.parametrize("seed", range(24))
def test_markers_of_random_pictures_are_the_same(studio, tip, detector, measure, seed):
    """Tips of all sizes, shades and noise, the edges of the picture among their places."""
    rng = np.random.default_rng(seed)
    size = (160, 120)
    tips = [
        tip(
            paint,
            *rng.uniform(0, size),
            rng.uniform(4, 22) if seed % 8 else 70.0,
            length_px=rng.uniform(6, 30),
            turn_rad=rng.uniform(0, 6.3),
            light_rad=rng.uniform(-1, 1),
        )
        for paint in studio.paints
    ]
    wall = tuple(rng.uniform(40, 220, 3))
    bgr = studio.bgr(studio.clean(tips, size, wall=wall)[0], rng.uniform(0, 8), seed)
    frame = (
        studio.of(bgr, layout="bgr"),
        studio.of(bgr),
        synthetic_images.frame_of(bgr, full_range=True),
    )[seed % 3]
    image, noise = picture(frame), Noise(rng.uniform(0.3, 3.0), rng.uniform(0.3, 3.0))
    blobs = detector.detect(image, whole(image.size))
    assert blobs
    agree(measure(image, blobs, noise), [centroids(image, [blob], noise)[0] for blob in blobs])


rects = st.tuples(
    st.integers(0, WIDTH - 1), st.integers(0, HEIGHT - 1), st.integers(1, WIDTH), st.integers(1, 14)
).map(lambda r: (r[0], r[1], min(r[0] + r[2], WIDTH), min(r[1] + r[3], HEIGHT)))


def picture_of(levels, full_range=False):
    """Planes of any levels, (3 HEIGHT, 2 WIDTH), as a picture."""
    size_px = (2 * WIDTH, 2 * HEIGHT)
    return picture(Frame("left", 0, 0, 0.0, size_px, levels, "i420", full_range))


def blob_of(rect, mask):
    part = np.ascontiguousarray(mask[rect[1] : rect[3], rect[0] : rect[2]])
    return make_blob(0, rect, part, int(np.count_nonzero(part)))


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 1 << 30),
    places=st.lists(rects, min_size=1, max_size=4),
    fill=st.floats(0, 1),
)
def test_hostile_blobs_of_random_levels_are_measured_like_others(measure, seed, places, fill):
    """Of one cell, empty, of the whole picture, beside each edge; pixels mean nothing."""
    rng = np.random.default_rng(seed)
    low, high = sorted(rng.integers(0, 256, 2))
    levels = rng.integers(low, high + 1, (HEIGHT * 3, WIDTH * 2), np.uint8)
    image = picture_of(levels, full_range=bool(seed % 2))
    mask = (rng.uniform(size=(HEIGHT, WIDTH)) < fill).astype(np.uint8) * 255
    blobs = [blob_of(rect, mask) for rect in places]
    noise = Noise(1.0, 1.0)
    for blob, found in zip(blobs, measure(image, blobs, noise), strict=True):
        (expected,) = centroids(image, [blob], noise)
        assert np.isfinite(found).all()
        tolerance = 1e-4 + 2e-3 * expected.sigma_px
        assert (found.x_px, found.y_px) == pytest.approx(
            (expected.x_px, expected.y_px), abs=tolerance
        )


def grows_by(rng, count):
    """Growth by colours that random levels often have, to any number of cells."""
    ranges = {"any": ColorRange(hsv_low=(0, 0, 0), hsv_high=(int(rng.integers(20, 180)), 255, 255))}
    near = NearPaint(compile_colors(Colors(colors=ranges), ["any"]))
    limits = [Limit(int(rng.integers(0, 300)), int(rng.integers(0, 30))) for _ in range(count)]
    return Growth(near, limits)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 1 << 30),
    places=st.lists(rects, min_size=1, max_size=4),
    fill=st.floats(0, 1),
)
def test_blobs_of_random_levels_grow_alike(measure, seed, places, fill):
    """To the edges of the picture among others: as if Python had grown them, to the last bit."""
    rng = np.random.default_rng(seed)
    levels = rng.integers(0, 256, (HEIGHT * 3, WIDTH * 2), np.uint8)
    image = picture_of(levels, full_range=bool(seed % 2))
    mask = (rng.uniform(size=(HEIGHT, WIDTH)) < fill).astype(np.uint8) * 255
    blobs = [blob_of(rect, mask) for rect in places]
    growth, noise = grows_by(rng, len(blobs)), Noise(1.0, 1.0)
    table, limits = growth.near.table, growth.limits
    larger = [grown(image, table, blob, by) for blob, by in zip(blobs, limits, strict=True)]
    found, expected = measure(image, blobs, noise, growth), measure(image, larger, noise)
    for n, (blob, one, other) in enumerate(zip(blobs, found, expected, strict=True)):
        # What has no paint is told as it was found, in C, and as it was grown in Python.
        assert one == other or other.area_px == larger[n].area_px != blob.area_px


@pytest.mark.parametrize("layout", ["i420", "bgr"])
def test_markers_half_of_which_their_ranges_miss_grow_alike(studio, tip, colors, measure, layout):
    narrow = Colors(colors={name: narrowed(own) for name, own in colors.colors.items()})
    table = compile_colors(narrow, list(studio.paints))
    near = NearPaint(compile_colors(near_colors(narrow), list(studio.paints)))
    grew = 0
    for seed in range(12):
        tips = [
            tip(paint, 25.0 + 45 * (n % 3), 30.0 + 50 * (n // 3), 9.0, light_rad=0.2 * seed)
            for n, paint in enumerate(studio.paints)
        ]
        image = picture(studio.frame(tips, seq=seed, size_px=(150, 120), layout=layout)[0])
        blobs = BlobDetector(table, Tracker()).detect(image, whole(image.size))
        growth = Growth(near, [limit(blob, 0.0, 0.0, 0.0) for blob in blobs])
        noise = Noise(1.44, 1.47)
        found = measure(image, blobs, noise, growth)
        agree(found, centroids(image, blobs, noise, growth))
        alone = measure(image, blobs, noise)
        grew += sum(
            one.area_px > 1.1 * other.area_px for one, other in zip(found, alone, strict=True)
        )
    assert grew > 5


def narrowed(own: ColorRange) -> ColorRange:
    """The lower half of a range's hues."""
    (low, *floors), (high, *tops) = own.hsv_low, own.hsv_high
    return ColorRange(
        hsv_low=(low, *floors), hsv_high=((low + (high - low) % 180 // 2) % 180, *tops)
    )


@pytest.mark.parametrize("numbers", [(9, -1), (9, 1 << 20), (9, 2**31 - 1)])
def test_cells_around_a_blob_that_are_none_are_refused(measure, numbers):
    image = picture_of(np.zeros((3 * HEIGHT, 2 * WIDTH), np.uint8))
    blob = make_blob(0, (2, 2, 6, 6), np.ones((4, 4), np.uint8), 16)
    growth = grows_by(np.random.default_rng(0), 0)._replace(limits=[Limit(*numbers)])
    with pytest.raises(ValueError, match="no such blob"):
        measure(image, [blob], Noise(), growth)


@pytest.mark.parametrize(
    "rect",
    [
        (-1, 0, 3, 3),
        (0, -1, 3, 3),
        (0, 0, WIDTH + 1, 3),
        (0, 0, 3, HEIGHT + 1),
        (3, 3, 3, 5),
        (3, 3, 5, 3),
        (5, 5, 3, 3),
        (WIDTH, HEIGHT, WIDTH + 2, HEIGHT + 2),
        (-(2**31), 0, 2**31 - 1, 4),
        (0, 0, 2**31 - 1, 2**31 - 1),
    ],
)
def test_a_blob_outside_the_picture_is_refused(measure, rect):
    image = picture_of(np.zeros((3 * HEIGHT, 2 * WIDTH), np.uint8))
    blob = make_blob(0, rect, np.ones((4, 4), np.uint8), 16)
    with pytest.raises(ValueError, match=r"no such blob: blobs at \[\("):
        measure(image, [blob], Noise())


def test_a_mask_smaller_than_its_rectangle_is_refused(measure):
    image = picture_of(np.zeros((3 * HEIGHT, 2 * WIDTH), np.uint8))
    blob = make_blob(0, (2, 2, 8, 8), np.ones((4, 4), np.uint8), 16)
    with pytest.raises(ValueError, match="masks too small"):
        measure(image, [blob], Noise())


def test_planes_smaller_than_the_picture_are_refused(measure):
    image = picture_of(np.zeros((3 * HEIGHT, 2 * WIDTH), np.uint8))
    taller = (WIDTH, 2 * HEIGHT)
    image.planes = dataclasses.replace(image.planes, rect=(0, 0, *taller), size=taller)
    blob = make_blob(0, (2, 2, 8, 8), np.ones((6, 6), np.uint8), 36)
    with pytest.raises(ValueError, match="no such picture"):
        measure(image, [blob], Noise())


def test_both_sides_have_the_same_structures(compiled):
    sizes = (ctypes.c_int32 * 3).in_dll(compiled, "rhot_sizes")
    constants = centroid_compiled._constants()
    blob = 4 * centroid_compiled.BLOB_NUMBERS
    assert list(sizes) == [PICTURE_IN_C.size, ctypes.sizeof(constants), blob]


def test_threads_do_not_share_memory(studio, tip, detector, noise, measure):
    """C runs without Python's lock."""
    images = []
    for n in range(6):
        tips = [tip("green", 30.0 + n, 31.0, 8.0 + 3 * n), tip("blue", 90.0, 40.0, 9.0)]
        image = picture(studio.frame(tips, seq=n, size_px=(128, 80))[0])
        images.append((image, detector.detect(image, whole(image.size))))
    alone = [measure(image, blobs, noise) for image, blobs in images]
    with ThreadPoolExecutor(3) as pool:
        for _ in range(20):
            assert list(pool.map(lambda one: measure(*one, noise), images)) == alone


def test_no_blobs_no_centroids(studio, measure, noise):
    assert measure(picture(studio.frame([])[0]), [], noise) == []


def test_the_tracker_takes_what_this_machine_has():
    assert fastest.centroids in (centroid_compiled.centroids, centroids)
    assert (fastest.centroids is centroids) == (centroid_compiled.centroids is None)
