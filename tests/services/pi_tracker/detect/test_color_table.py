"""The lookup tables hold the HSV ranges that people edit."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.hsv_range import hsv_mask


def span(low, high):
    return ColorRange(hsv_low=low, hsv_high=high)


def table_of(**ranges):
    """The table of all ranges, in their order."""
    return compile_colors(Colors(colors=ranges), list(ranges))


@pytest.fixture(scope="module")
def gamut():
    """Luma (h, w), chroma (h, w, 2), their HSV by OpenCV, and which of them RGB shows unclipped."""
    rng = np.random.default_rng(0)
    luma = rng.integers(16, 236, (240, 320), dtype=np.uint8)
    chroma = rng.integers(16, 241, (240, 320, 2), dtype=np.uint8)
    doubled = luma.repeat(2, 0).repeat(2, 1)
    i420 = np.concatenate(
        [doubled.ravel(), chroma[..., 0].ravel(), chroma[..., 1].ravel()]
    ).reshape(720, 640)
    bgr = cv2.cvtColor(i420, cv2.COLOR_YUV2BGR_I420)[::2, ::2]
    shown = ((bgr > 0) & (bgr < 255)).all(axis=-1)
    return luma, chroma, cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV), shown


@settings(max_examples=40, deadline=None)
@given(
    low=st.tuples(st.integers(0, 179), st.integers(0, 200), st.integers(0, 200)),
    high=st.tuples(st.integers(0, 179), st.integers(30, 255), st.integers(30, 255)),
)
def test_the_table_is_the_hsv_test(gamut, low, high):
    luma, chroma, hsv, shown = gamut
    table = table_of(a=span(low, high))
    ours, theirs = table.classify(luma, chroma) > 0, hsv_mask(hsv, span(low, high)) > 0
    # OpenCV rounds RGB before it takes the hue: where the chroma is small, the hue moves by more
    # than one.
    clear = shown & (np.abs(chroma.astype(int) - 128).max(axis=-1) > 12)
    assert (ours != theirs)[clear].mean() < 0.02


def test_the_mask_is_where_a_class_is(gamut):
    luma, chroma, _, _ = gamut
    ranges = {
        "a": span((100, 100, 160), (130, 255, 255)),
        "b": span((100, 100, 40), (130, 255, 150)),
        "c": span((20, 90, 50), (60, 255, 255)),
    }
    for names in (["c"], ["a", "b", "c"]):
        table = table_of(**{name: ranges[name] for name in names})
        classes = table.classify(luma, chroma)
        assert not np.any((classes > 0) & (table.candidates(luma, chroma) == 0))
        for margin in (0, 2):
            left, top, inside, mask = table.classify_cropped(luma, chroma, margin)
            assert np.array_equal(mask > 0, inside > 0)
            placed = np.zeros_like(classes)
            placed[top : top + inside.shape[0], left : left + inside.shape[1]] = inside
            assert np.array_equal(placed, classes)


def test_numpy_looks_up_what_opencv_does(gamut, monkeypatch):
    luma, chroma, _, _ = gamut
    ranges = {"a": span((100, 100, 60), (130, 255, 255))}
    expected = table_of(**ranges).classify(luma, chroma).copy()

    def refuse(*_):
        raise cv2.error("an OpenCV before 5 takes bytes only")

    monkeypatch.setattr(cv2, "LUT", refuse)
    assert np.array_equal(table_of(**ranges).classify(luma, chroma), expected)


def test_a_range_that_is_empty_in_itself_finds_nothing(gamut):
    luma, chroma, _, _ = gamut
    table = table_of(
        a=span((0, 200, 0), (179, 100, 255)),
        b=span((0, 0, 200), (179, 255, 100)),
    )
    assert not table.classify(luma, chroma).any()


def test_white_and_black_are_colours_too(gamut):
    luma, chroma, _, _ = gamut
    grey = np.full_like(chroma, 128)
    table = table_of(
        white=span((0, 0, 180), (179, 40, 255)),
        black=span((0, 0, 0), (179, 255, 40)),
    )
    found = table.classify(luma, grey)
    assert set(np.unique(found)) == {0, 1, 2}
    assert luma[found == 1].min() > luma[found == 2].max()


def test_overlapping_hues_go_to_the_nearer_colour(gamut):
    luma, chroma, hsv, shown = gamut
    table = table_of(
        a=span((40, 80, 60), (80, 255, 255)),
        b=span((70, 80, 60), (110, 255, 255)),
    )
    assert len(table.layers) == 1
    found = table.classify(luma, chroma)
    hue = hsv[..., 0]
    assert not np.any(found[shown & (hue > 77) & (hue < 108)] == 1)
    assert not np.any(found[shown & (hue < 73)] == 2)


def test_dark_and_light_of_one_hue_are_told_apart(gamut):
    luma, chroma, hsv, shown = gamut
    light, dark = span((100, 100, 160), (130, 255, 255)), span((100, 100, 40), (130, 255, 150))
    table = table_of(light=light, dark=dark)
    assert len(table.layers) == 2
    found = table.classify(luma, chroma)
    for number, one in enumerate((light, dark), start=1):
        expected = (hsv_mask(hsv, one) > 0) & shown
        assert (found[expected] == number).mean() > 0.97


def test_a_colour_without_calibration_is_named():
    colors = Colors(
        colors={
            "blue": span((100, 80, 40), (120, 255, 255)),
            "green": span((50, 80, 40), (80, 255, 255)),
        }
    )
    with pytest.raises(
        CalibrationError,
        match=r"left\.colors\.json: colour 'mauve' .* it has blue, green.*rhot calibrate colors",
    ):
        compile_colors(colors, ["blue", "mauve"], "calibration/left.colors.json")
