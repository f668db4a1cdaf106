"""Marks over a picture: found, lost where it was last, looked for; strangers get no code in."""

from __future__ import annotations

import itertools
import re
from xml.etree import ElementTree

import msgspec
import pytest

from rhot.messages import Marker
from rhot.messages.camera import SeenInPicture
from services.viewer.pictures.marks import Marks

SECOND_NS = 1_000_000_000
STAMP_NS = 1_700_000_000 * SECOND_NS


def marker(color: str, x: float = 100.0, y: float = 50.0, sigma: float = 0.05) -> Marker:
    return Marker(color=color, x_px=x, y_px=y, area_px=80.0, sigma_px=sigma, quality=0.9)


def seen(*markers: Marker, after_s: float = 0.0, **changes: object) -> SeenInPicture:
    made = SeenInPicture(
        stamp_ns=STAMP_NS + round(after_s * SECOND_NS),
        size_px=(640, 480),
        markers=list(markers),
        looked_for=["green", "blue"],
        searched_px=(40, 20, 240, 120),
    )
    return msgspec.structs.replace(made, **changes)


def words(svg: str) -> list[str]:
    return [found.text or "" for found in ElementTree.fromstring(svg).iter("text")]


def test_a_found_marker_has_its_circle_and_its_region() -> None:
    root = ElementTree.fromstring(Marks().svg(seen(marker("green"), marker("blue", 300.0))))
    assert root.get("viewBox") == "0 0 640 480"
    rings = [(float(c.get("cx", 0)), float(c.get("cy", 0))) for c in root.iter("circle")]
    assert rings.count((100.5, 50.5)) == 2, "a white ring on a black one"
    assert next(root.iter("rect")).get("width") == "200"
    assert [found.text or "" for found in root.iter("text")] == ["green", "blue", ""]


def test_a_lost_colour_stays_where_it_was_for_a_while() -> None:
    marks = Marks()
    assert words(marks.svg(seen(marker("green")))) == ["green", "not in view: blue"]
    assert words(marks.svg(seen(after_s=4.0))) == ["green: lost", "not in view: blue"]
    assert words(marks.svg(seen(after_s=6.0))) == ["not in view: green, blue"]
    # Found again, and then the clock is set back: what was, is no past of this.
    marks.svg(seen(marker("green"), after_s=7.0))
    assert words(marks.svg(seen(after_s=1.0))) == ["not in view: green, blue"]


def test_the_whole_picture_is_no_box() -> None:
    svg = Marks().svg(seen(marker("green"), marker("blue"), searched_px=(0, 0, 640, 480)))
    assert "<rect" not in svg
    assert words(svg)[-1] == "searched everywhere"
    assert "<rect" not in Marks().svg(seen(searched_px=None))


@pytest.mark.parametrize("x", [1e308, -1e308, 646.0, -7.0])
def test_what_lies_outside_is_not_drawn(x: float) -> None:
    svg = Marks().svg(seen(marker("green", x), marker("blue", 10.0, sigma=1e308)))
    assert words(svg)[0] == "blue"
    assert len(svg) < 2000
    assert max(map(float, re.findall(r' r="([\d.]+)"', svg))) <= 64.0


def test_what_the_edge_cuts_is_drawn_around_its_middle() -> None:
    root = ElementTree.fromstring(Marks().svg(seen(marker("green", -3.0))))
    assert {float(c.get("cx", 0)) for c in root.iter("circle")} == {-2.5}


def test_much_is_counted() -> None:
    many = [f"c{n}" for n in range(256)]
    svg = Marks().svg(seen(looked_for=many))
    assert words(svg) == ["not in view: c0, c1, c2, c3, c4, c5 and 250 more"]


def test_no_name_covers_another() -> None:
    # Finger tips of a hand that holds something, as far apart as its dots.
    near = [marker(f"colour{n}", 300.0 + 8.0 * n, 200.0 + 6.0 * n) for n in range(4)]
    svg = Marks().svg(seen(*near, looked_for=[one.color for one in near]))
    boxes = []
    for text in ElementTree.fromstring(svg).iter("text"):
        if not text.text:
            continue
        letter = 640 / 26
        long = 0.5 * letter * len(text.text)
        x, y = float(text.get("x", 0)), float(text.get("y", 0))
        left = x - long * {"start": 0.0, "middle": 0.5, "end": 1.0}[text.get("text-anchor", "")]
        boxes.append((left, y - letter, left + long, y))
    assert len(boxes) == 4
    for one, other in itertools.combinations(boxes, 2):
        apart = one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]
        assert apart, (one, other)
