"""Ranges fitted to what was pointed at, judged by what they find afterwards."""

from __future__ import annotations

import itertools

import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.colors.report import examine
from services.pi_tracker.image.chroma import cells_of
from services.pi_tracker.image.hue import hue_difference
from services.pi_tracker.step import TrackerStep
from testing.synthetic_images import ROW_X_PX

SIZE = (240, 120)


@pytest.fixture(scope="module")
def hand(studio, tip):
    """Frames of six tips, a little elsewhere and in other light each time, and clicks on them."""

    def make(count, layout="i420", first=0, **options):
        frames, pointers = [], []
        for number in range(count):
            tips = [
                tip(c, x + 2 * number, 60.0 + 3 * number, width_px=13.0, length_px=14.0)
                for c, x in ROW_X_PX.items()
            ]
            frame, truth = studio.frame(
                tips, seq=first + number, size_px=SIZE, layout=layout, **options
            )
            frames.append(frame)
            pointers += [Pointer(color, number, *place) for color, place in truth.items()]
        return frames, pointers

    return make


@pytest.mark.parametrize("layout", ["i420", "bgr"])
def test_fitted_ranges_find_every_marker_and_nothing_else(hand, layout):
    frames, pointers = hand(3, layout)
    training = gather(frames, pointers)
    fitted = fit(training.samples)
    assert training.notes == []
    report = examine(training, fitted)
    assert report.warnings == ()
    assert all(one.inside > 0.9 and one.pictures == 3 for one in report.colors)
    step = TrackerStep("left", Colors(colors=fitted), Tracker(), SIZE, list(ROW_X_PX))
    for options in ({}, {"sigma": 8.0}, {"blur_px": 1.6}, {"shading": 0.7}):
        fresh, _ = hand(4, layout, first=50, **options)
        for frame in fresh:
            found = {marker.color: marker.x_px for marker in step.step(frame).markers}
            assert set(found) == set(ROW_X_PX), options


def test_the_same_input_gives_the_same_ranges(hand):
    frames, pointers = hand(2)
    assert fit(gather(frames, pointers).samples) == fit(gather(frames, pointers).samples)


def test_hues_wrap_through_red(studio, tip, monkeypatch):
    monkeypatch.setitem(studio.paints, "red", (30, 25, 210))
    frame, truth = studio.frame(
        [tip("red", 60.0, 60.0, width_px=16.0, length_px=18.0)], size_px=SIZE
    )
    training = gather([frame], [Pointer("red", 0, *truth["red"])])
    span = fit(training.samples)["red"]
    assert span.hsv_low[0] > 150
    assert span.hsv_high[0] < 30
    assert examine(training, {"red": span}).colors[0].inside > 0.8


def test_neighbours_share_the_hues_between_them(hand):
    frames, pointers = hand(3)
    fitted = fit(gather(frames, pointers).samples)
    names = sorted(fitted, key=lambda name: fitted[name].hsv_low[0])
    for one, other in itertools.pairwise(names):
        assert fitted[one].hsv_high[0] <= fitted[other].hsv_low[0], (one, other)


def test_two_dabs_of_one_paint_collide(hand):
    frames, pointers = hand(2)
    twice = [p for p in pointers if p.color == "green"]
    twice += [Pointer("blue", p.frame, p.x_px, p.y_px) for p in twice]
    training = gather(frames, twice)
    report = examine(training, fit(training.samples))
    assert any(
        "blue and green collide" in warning and "cannot be told apart" in warning
        for warning in report.warnings
    )
    assert report.pairs[0].separation < 1.0


def test_paint_of_the_colour_of_skin_is_warned_of(studio, tip, monkeypatch):
    monkeypatch.setitem(studio.paints, "ochre", (105, 140, 205))
    frame, truth = studio.frame(
        [tip("ochre", 60.0, 60.0, width_px=18.0, length_px=20.0)], size_px=SIZE
    )
    x, y = truth["ochre"]
    training = gather([frame], [Pointer("ochre", 0, x - 10, y - 10, 20, 20)])
    report = examine(training, fit(training.samples))
    assert any(
        "colour of skin" in warning or "close to skin" in warning for warning in report.warnings
    )


def test_a_room_of_the_same_hue_is_warned_of_with_its_place(studio, tip):
    clean, truth = studio.clean([tip("green", 60.0, 60.0, width_px=14.0, length_px=16.0)], SIZE)
    clean[20:50, 180:220] = studio.paints["green"]
    training = gather(
        [studio.of(studio.bgr(clean, 5.0, 1))], [Pointer("green", 0, *truth["green"])]
    )
    report = examine(training, fit(training.samples))
    (warning,) = [
        warning for warning in report.warnings if "the room has the hue of green" in warning
    ]
    (one,) = report.colors
    assert one.room_at is not None
    assert abs(one.room_at[0] - 200) < 4
    assert abs(one.room_at[1] - 35) < 4
    assert "in picture 1" in warning


def test_a_room_of_weaker_colour_is_kept_out(studio, tip):
    """A greenish grey cupboard: pale enough to be left outside by saturation."""
    clean, truth = studio.clean([tip("green", 60.0, 60.0, width_px=14.0, length_px=16.0)], SIZE)
    clean[10:110, 130:230] = (115, 135, 112)
    training = gather(
        [studio.of(studio.bgr(clean, 5.0, 1))], [Pointer("green", 0, *truth["green"])]
    )
    fitted = fit(training.samples)
    assert examine(training, fitted).warnings == ()
    assert examine(training, fitted).colors[0].inside > 0.85


def test_ranges_that_are_already_there_are_checked_too(hand, colors):
    frames, pointers = hand(1)
    green = [p for p in pointers if p.color == "green"]
    training = gather(frames, green)
    wide = {"lime": colors.colors["green"]}
    report = examine(training, fit(training.samples), wide)
    assert any("ranges of green and lime overlap" in warning for warning in report.warnings)


def test_a_click_beside_the_marker_is_left_out_with_a_note(hand):
    frames, pointers = hand(3)
    green = [p for p in pointers if p.color == "green"]
    grey = Pointer("green", 1, 5.0, 5.0)
    training = gather(frames, [green[0], grey, green[2]])
    assert len(training.samples["green"].patches) == 2
    assert "something grey" in training.notes[0]
    assert "left out" in training.notes[0]


def test_another_colour_among_three_is_left_out_with_a_note(hand):
    frames, pointers = hand(3)
    green = [p for p in pointers if p.color == "green"]
    blue = next(p for p in pointers if p.color == "blue" and p.frame == 1)
    training = gather(frames, [green[0], Pointer("green", 1, blue.x_px, blue.y_px), green[2]])
    assert [patch.frame for patch in training.samples["green"].patches] == [0, 2]
    assert "another hue" in training.notes[0]


@pytest.mark.parametrize(
    ("pointers", "message"),
    [
        ([], "nothing is pointed at"),
        ([Pointer("green", 7, 10.0, 10.0)], "there is no picture 7; there are 1"),
        ([Pointer("green", 0, 5.0, 5.0)], "something grey"),
    ],
)
def test_what_cannot_be_fitted_says_why(hand, pointers, message):
    frames, _ = hand(1)
    with pytest.raises(CalibrationError, match=message):
        gather(frames, pointers)


def test_cells_are_those_of_the_lookup_table(hand):
    """Hue and saturation as OpenCV has them, to rounding."""
    frames, pointers = hand(1)
    cells = cells_of(frames[0])
    for pointer in pointers:
        hue, saturation, _ = cells[int(pointer.y_px) // 2, int(pointer.x_px) // 2].hsv()
        assert (
            abs(
                hue_difference(
                    float(hue),
                    {
                        "green": 57,
                        "blue": 109,
                        "magenta": 165,
                        "cyan": 92,
                        "violet": 135,
                        "lime": 39,
                    }[pointer.color],
                )
            )
            < 8
        )
        assert 80 < float(saturation) <= 255


def test_hues_are_drawn_in_where_skin_begins(studio, tip, monkeypatch):
    """Yellow ochre next to skin: as pale as it, a few hues away."""
    monkeypatch.setitem(studio.paints, "sand", (90, 185, 190))
    frames, pointers = [], []
    for seq in range(2):
        frame, truth = studio.frame(
            [tip("sand", 60.0 + 9 * seq, 60.0, width_px=20.0, length_px=24.0)],
            seq=seq,
            size_px=SIZE,
        )
        frames.append(frame)
        x, y = truth["sand"]
        pointers.append(Pointer("sand", seq, x - 12, y - 12, 24, 24))
    training = gather(frames, pointers)
    fitted = fit(training.samples)
    (one,) = examine(training, fitted).colors
    assert one.inside > 0.75
    assert one.room_px < 60
    # Skin has a hue of 11 here, the paint 28.
    assert 14 <= fitted["sand"].hsv_low[0] <= 27


def test_a_large_blob_in_one_picture_does_not_outvote_small_ones_in_others(studio, tip):
    """Two small tips in dim, bluish light, and one in good light that fills the picture."""
    frames, pointers = [], []
    for seq in range(3):
        width, light = (90.0, (1.0, 1.0, 1.0)) if seq == 2 else (11.0, (0.5, 0.4, 0.3))
        patch = tip("green", 100.0, 60.0, width_px=width, length_px=width)
        clean, truth = studio.clean([patch], SIZE)
        frames.append(studio.of(studio.bgr((clean * light).astype("uint8"), 2.0, seq)))
        x, y = truth["green"]
        pointers.append(Pointer("green", seq, x - width / 2, y - width / 2, width, width))
    training = gather(frames, pointers)
    counts = [int(patch.core.sum()) for patch in training.samples["green"].patches]
    assert len(counts) == 3
    assert counts[2] > 50 * max(counts[:2])
    report = examine(training, fit(training.samples))
    assert not [text for text in report.warnings if "takes nothing" in text]
    assert report.colors[0].inside > 0.85
    assert report.colors[0].cells == sum(counts)


def test_each_picture_in_which_a_range_takes_nothing_is_named(hand):
    frames, pointers = hand(3)
    green = [p for p in pointers if p.color == "green"]
    blue = next(p for p in pointers if p.color == "blue" and p.frame == 1)
    training = gather(
        frames, [green[0], Pointer("green", 1, blue.x_px, blue.y_px), green[2]], ["a", "b", "c"]
    )
    span = fit(training.samples)["green"]
    dim = ColorRange(hsv_low=(span.hsv_low[0], 250, 0), hsv_high=span.hsv_high)
    warnings = examine(training, {"green": dim}).warnings
    for name in ("a", "b", "c"):
        assert sum(f"takes nothing in {name}, although" in text for text in warnings) == 1


def test_a_picture_in_which_nobody_pointed_and_nothing_is_taken_is_named(hand, studio):
    frames, pointers = hand(2)
    empty, _ = studio.frame([], seq=9, size_px=SIZE)
    green = [p for p in pointers if p.color == "green"]
    training = gather([*frames, empty], green, ["a", "b", "c"])
    (warning,) = examine(training, fit(training.samples)).warnings
    assert "takes nothing in c; if green can be seen there" in warning
