"""Dots of one colour in pictures: found, named, told as markers, from the step and its messages."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest

from rhot.files.rig_tables import Tracker
from rhot.messages import Marker
from services.cli.offline.looking_back import looked_back
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.dots.finder import DotFinder
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.step import TrackerStep
from testing.dot_pictures import COLORS, DOTS, NAMES, REST, SIZE, dot_picture, dot_places


def _by_name(markers: list[Marker]) -> dict[str, tuple[float, float]]:
    return {marker.color: (marker.x_px, marker.y_px) for marker in markers}


def _step(seeds: dict[str, tuple[float, float]] | None, *, remembers: bool = False) -> TrackerStep:
    colors = ["blue", "red"]
    return TrackerStep(
        "side",
        COLORS,
        Tracker(),
        SIZE,
        colors,
        dots=DOTS,
        seeds=seeds,
        remembers_dots=remembers,
    )


@pytest.mark.parametrize("seeded", [True, False])
def test_eight_dots_of_one_colour_are_eight_markers_beside_another_colour(seeded: bool) -> None:
    places = dot_places(0)
    seeds = {n: (x + 3.0, y + 2.0) for n, (x, y) in zip(NAMES, places, strict=True)}
    step = _step(seeds if seeded else None)
    for number in range(21):
        truth = dot_places(number)
        found = _by_name(step.step(dot_picture(number, truth)).markers)
        assert found["blue"] == pytest.approx((500, 60), abs=1.0)
        for name, (x, y) in zip(NAMES, truth, strict=True):
            assert found[f"red.{name}"] == pytest.approx((x, y), abs=4.0), (number, name)
    assert not step.notes


def test_new_ranges_leave_the_dots_their_names() -> None:
    seeds = {n: (x, y) for n, (x, y) in zip(NAMES, REST, strict=True)}
    step = TrackerStep("side", COLORS, Tracker(), SIZE, ["red"], dots=DOTS, seeds=seeds)
    before = _by_name(step.step(dot_picture(0, REST)).markers)
    step.apply_colors(COLORS, "side.colors.json")
    after = _by_name(step.step(dot_picture(1, REST)).markers)
    assert set(before) == set(after) == set(DOTS["red"].values())
    for name, place in before.items():
        assert after[name] == pytest.approx(place, abs=1.0)


def test_a_recording_is_told_again_with_hindsight() -> None:
    """Frame by frame, in their order; markers of other colours stay as they are."""
    seeds = {n: (x, y) for n, (x, y) in zip(NAMES, REST, strict=True)}
    step = _step(seeds, remembers=True)
    live = [step.step(dot_picture(number, dot_places(number))) for number in range(12)]
    again = list(looked_back(live, {"side": step}, 1, Path(tempfile.gettempdir()), False))
    assert [frame.seq for frame in again] == list(range(12))
    for number, frame in enumerate(again):
        found = _by_name(frame.markers)
        assert len(frame.markers) == len(found) == 9
        assert found["blue"] == _by_name(live[number].markers)["blue"]
        for name, (x, y) in zip(NAMES, dot_places(number), strict=True):
            assert found[f"red.{name}"] == pytest.approx((x, y), abs=4.0), (number, name)


def test_a_recording_whose_shared_colour_is_not_asked_for_stays_as_it_is() -> None:
    step = TrackerStep("side", COLORS, Tracker(), SIZE, ["blue"], dots=DOTS, remembers_dots=True)
    live = [step.step(dot_picture(number, dot_places(number))) for number in range(3)]
    assert [len(frame.markers) for frame in live] == [1, 1, 1]
    told = looked_back(live, {"side": step}, 1, Path(tempfile.gettempdir()), False)
    assert list(told) == live


def _discs(seq: int, radii: list[float]) -> Frame:
    """The dots at rest as sharp red discs of these radii, px; of 0, a bar one cell wide."""
    image: Image = np.full((SIZE[1], SIZE[0], 3), (110, 140, 200), np.uint8)
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    for (x, y), radius in zip(REST, radii, strict=True):
        width, height = (radius, radius) if radius else (1.0, 6.0)
        inside = ((columns + 0.5 - x) / width) ** 2 + ((rows + 0.5 - y) / height) ** 2 < 1.0
        image[inside] = (35, 25, 190)
    return Frame("side", seq, seq * 33_333_333, 0.0, SIZE, image, "bgr")


def _finder() -> DotFinder:
    table = compile_colors(COLORS, ["red"])
    seeds = {n: (x, y) for n, (x, y) in zip(NAMES, REST.tolist(), strict=True)}
    return DotFinder(table, "red", Tracker(), NAMES, SIZE, seeds, remembers=True)


def test_a_dot_that_turns_until_it_is_one_cell_wide_is_still_told() -> None:
    finder = _finder()
    for number in range(4):
        finder.find(_discs(number, [8.0] * 8))
    for number in range(4, 8):
        dots = finder.find(_discs(number, [8.0] * 6 + [0.0, 8.0]))
        assert [dot.state for dot in dots.values()] == ["seen"] * 8
        sliver = dots[NAMES[6]]
        assert (sliver.x_px, sliver.y_px) == pytest.approx(REST[6], abs=2.0)


def test_dots_that_were_blurred_at_the_start_are_one_each_when_they_are_sharp() -> None:
    """Expected: blurred ones leave a middle of a quarter of their area, and are not cut later."""
    finder = _finder()
    for number in range(4):
        finder.find(_discs(number, [4.0] * 8))
    for number in range(4, 8):
        dots = finder.find(_discs(number, [8.0] * 8))
        patches = finder.seen[-1].patches
        assert len(patches) == 8
        assert all(patch.whole < 0 for patch in patches)
        for dot, place in zip(dots.values(), REST, strict=True):
            assert (dot.x_px, dot.y_px) == pytest.approx(place, abs=1.0)
