"""The whole step: a MarkerFrame for every frame, the same for the same input."""

from __future__ import annotations

import dataclasses
import itertools

import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import Colors
from rhot.files.rig_tables import Tracker
from rhot.messages import MarkerFrame
from services.pi_tracker.step import TrackerStep

SIZE = (320, 240)


@pytest.fixture
def moving(studio, tip):
    """Eight noisy frames of three tips that move 12 px a frame, and where they are."""

    def frames(layout="i420", count=8):
        for seq in range(count):
            x = 60.0 + 12 * seq
            tips = [tip("green", x, 60.0), tip("blue", x + 30, 50.0), tip("magenta", x + 55, 75.0)]
            yield studio.frame(tips, seq, layout, size_px=SIZE)

    return frames


def tracker(colors, color_names=("green", "blue", "magenta"), clock=None, **settings):
    return TrackerStep("left", colors, Tracker(**settings), SIZE, color_names, clock)


@pytest.mark.parametrize("layout", ["i420", "bgr"])
@pytest.mark.parametrize(("method", "tolerance_px"), [("lut", 0.4), ("paper", 1.2)])
def test_markers_are_where_the_paint_is(moving, colors, layout, method, tolerance_px):
    step = tracker(colors, method=method)
    for frame, truth in moving(layout):
        message = step.step(frame, 5, 7)
        assert (message.camera, message.seq, message.stamp_ns, message.size_px) == (
            "left",
            frame.seq,
            frame.stamp_ns,
            SIZE,
        )
        assert (message.clock_offset_ns, message.clock_sigma_ns) == (5, 7)
        found = {marker.color: marker for marker in message.markers}
        assert set(found) == set(truth)
        for name, marker in found.items():
            assert (marker.x_px, marker.y_px) == pytest.approx(truth[name], abs=tolerance_px)
            assert 35 < marker.area_px < 160
            assert 0.0 < marker.sigma_px < 0.6
            assert marker.quality > 0.5


def test_people_are_told_what_is_looked_for_and_where(moving, colors):
    step = tracker(colors)
    told = [step.seen(step.step(frame)) for frame, _ in moving(count=8)]
    assert all(one.looked_for == ["green", "blue", "magenta"] for one in told)
    # The first frames are searched everywhere, to learn the background.
    assert told[0].searched_px == (0, 0, *SIZE)
    left, top, right, bottom = told[-1].searched_px
    assert (right - left) * (bottom - top) < 0.5 * SIZE[0] * SIZE[1]
    assert len(told[-1].markers) == 3
    for marker in told[-1].markers:
        assert left < marker.x_px < right
        assert top < marker.y_px < bottom
    other = tracker(colors, method="paper")
    assert other.seen(other.step(next(moving())[0])).searched_px is None


@pytest.mark.parametrize("noise_levels", [2.0, 5.0])
def test_both_ranges_of_a_pi_give_the_same_markers(studio, tip, colors, noise_levels):
    """The same scene with the same noise, as YUV420 in limited and in full range."""
    steps = {wide: tracker(colors) for wide in (False, True)}
    differences_px = []
    for seq in range(40):
        x = 60.3 + 1.7 * seq
        tips = [tip("green", x, 60.0), tip("blue", x + 30, 50.0), tip("magenta", x + 55, 75.0)]
        clean, truth = studio.clean(tips, size_px=SIZE)
        bgr = studio.bgr(clean, noise_levels, seq)
        limited, full = (
            {m.color: m for m in step.step(studio.of(bgr, seq, full_range=wide)).markers}
            for wide, step in steps.items()
        )
        assert set(limited) == set(full) == set(truth)
        for name, marker in limited.items():
            other = full[name]
            assert other.sigma_px == pytest.approx(marker.sigma_px, rel=0.15)
            differences_px += [marker.x_px - other.x_px, marker.y_px - other.y_px]
    # Half of that is measured; single markers differ by up to 0.08 px, where rounding decides
    # whether a cell at the rim belongs to a blob.
    assert np.sqrt(np.mean(np.square(differences_px))) <= 0.02


@pytest.mark.parametrize("method", ["lut", "paper"])
def test_a_frame_without_markers_is_a_message_too(studio, colors, method):
    frame, _ = studio.frame([], 3, size_px=SIZE)
    message = tracker(colors, method=method).step(frame)
    assert message.markers == []
    assert msgspec.json.decode(msgspec.json.encode(message), type=MarkerFrame) == message


def test_the_same_frames_give_the_same_bytes(moving, colors):
    runs = [
        [msgspec.json.encode(step.step(frame)) for frame, _ in moving()]
        for step in (tracker(colors), tracker(colors))
    ]
    assert runs[0] == runs[1]


def test_a_jump_further_than_the_margin_is_found_in_the_same_frame(studio, tip, colors):
    step = tracker(colors, ["green"], roi_margin_px=10)
    for seq, x in enumerate((40.0, 44.0, 260.0)):
        frame, truth = studio.frame([tip("green", x, 100.0)], seq, size_px=SIZE)
        (marker,) = step.step(frame).markers
        assert (marker.x_px, marker.y_px) == pytest.approx(truth["green"], abs=0.4)


def test_a_reflection_of_the_colour_does_not_win(studio, tip, colors):
    step = tracker(colors)
    hand = [tip("green", 100.0, 100.0), tip("blue", 125.0, 90.0), tip("magenta", 110.0, 135.0)]
    reflection = tip("green", 290.0, 30.0, 40.0, 30.0, turn_rad=1.57)
    for seq in range(3):
        frame, _ = studio.frame([*hand, reflection], seq, size_px=SIZE)
        green = next(marker for marker in step.step(frame).markers if marker.color == "green")
        assert green.x_px < 150


def test_noise_alone_is_no_marker(colors):
    from services.pi_tracker.image.frame import Frame

    rng = np.random.default_rng(5)
    step = tracker(colors)
    for seq in range(3):
        image = np.clip(rng.normal(110, 12, (240, 320, 3)), 0, 255).astype(np.uint8)
        assert step.step(Frame("left", seq, seq, 0.0, SIZE, image, "bgr")).markers == []


def test_a_frame_of_another_size_is_tracked_as_it_is(studio, tip, colors):
    frame, _ = studio.frame([tip("green", 40.0, 40.0)], size_px=(80, 90))
    message = tracker(colors).step(frame)
    assert message.size_px == (80, 90)
    assert [marker.color for marker in message.markers] == ["green"]


def test_a_rolling_shutter_is_told_by_the_frame_or_else_by_rig_toml(studio, tip, colors):
    (frame, _) = studio.frame([tip("green", 60.0, 60.0)], 0, "bgr", size_px=SIZE)
    step = TrackerStep("left", colors, Tracker(), SIZE, ("green",), readout_ms=24.0)
    for own_ns, told_ns in ((0.0, 24e6 / SIZE[1]), (30_000.0, 30_000.0)):
        message = step.step(dataclasses.replace(frame, row_time_ns=own_ns))
        assert message.row_time_ns == pytest.approx(told_ns)
    assert tracker(colors).step(dataclasses.replace(frame, row_time_ns=0.0)).row_time_ns == 0.0


def test_the_size_may_change_while_running(studio, tip, colors):
    step = tracker(colors)
    for seq, size_px in enumerate([(160, 120), (64, 48), (160, 120)]):
        frame, _ = studio.frame(
            [tip("green", size_px[0] - 20.0, size_px[1] - 20.0)], seq, size_px=size_px
        )
        assert len(step.step(frame).markers) == 1


def test_stages_are_timed_with_the_clock_that_is_given(moving, colors):
    ticks = itertools.count(step=1_000_000)
    step = tracker(colors, clock=lambda: next(ticks))
    for frame, _ in moving(count=2):
        step.step(frame)
    assert {"search", "identity", "centroid", "step"} <= set(step.times_ms)
    assert step.times_ms["search"] == pytest.approx(1.0)
    untimed = tracker(colors)
    untimed.step(frame)
    assert untimed.times_ms == {}


def test_new_colours_apply_from_the_next_frame(studio, tip, colors):
    step = tracker(colors, ["green"])
    frame, _ = studio.frame([tip("green", 60.0, 60.0)], size_px=SIZE)
    assert len(step.step(frame).markers) == 1
    step.apply_colors(Colors(colors={"green": colors.colors["blue"]}), "left.colors.json")
    assert step.step(frame).markers == []
    with pytest.raises(CalibrationError, match="'green'"):
        step.apply_colors(Colors(colors={}), "left.colors.json")
    assert step.step(frame).markers == []


@pytest.mark.parametrize("method", ["lut", "paper"])
def test_a_colour_without_calibration_ends_the_start(colors, method):
    with pytest.raises(
        CalibrationError,
        match=r"left\.colors\.json: colour 'pink' .* blue, cyan, green, lime, magenta, violet",
    ):
        tracker(colors, ["green", "pink"], method=method)


def test_no_colours_no_markers(studio, tip, colors):
    frame, _ = studio.frame([tip("green", 60.0, 60.0)], size_px=SIZE)
    assert tracker(colors, []).step(frame).markers == []
