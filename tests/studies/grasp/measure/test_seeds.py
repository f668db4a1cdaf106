"""Seeds and lengths as people give them: each mistake is told in its own words."""

from __future__ import annotations

import pytest

from rhot.errors import CaptureError
from studies.grasp.measure.scale import known_scale, parse_lengths, scale_of_lengths
from studies.grasp.measure.seeds import (
    check_seeds,
    decode_seeds,
    for_method,
    missing_notes,
    parse_line,
    parse_seeds,
)

FOUR = {
    f"index_{joint}": (100.0 + 50.0 * k, 80.0)
    for k, joint in enumerate(("mcp", "pip", "dip", "tip"))
}


def test_seeds_have_several_names():
    assert parse_seeds(["index_tip=512,300.5", "pip=1,2", "base=3,4"]) == {
        "index_tip": (512.0, 300.5),
        "index_pip": (1.0, 2.0),
        "index_wrist": (3.0, 4.0),
    }
    assert decode_seeds(b'{"thumb_mcp": [5, 6]}', "s.json") == {"thumb_mp": (5.0, 6.0)}
    assert parse_line("1,2,30,4") == {"base_start": (1.0, 2.0), "base_end": (30.0, 4.0)}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("index_tip", "is not joint=x,y"),
        ("index_tip=1.2.3,4", "is not joint=x,y"),
        ("index_nail=1,2", "no such joint; valid: index_wrist"),
        ("toe_tip=1,2", "no such joint; valid: index"),
    ],
)
def test_a_seed_that_is_none(text, why):
    with pytest.raises(CaptureError, match=why):
        parse_seeds([text])


@pytest.mark.parametrize("content", [b"[1]", b"\xff", b"", b'{"index_tip": [1]}'])
def test_a_file_without_seeds(content):
    with pytest.raises(CaptureError, match=r"s\.json: holds no seeds"):
        decode_seeds(content, "s.json")


def test_a_joint_twice():
    with pytest.raises(CaptureError, match="given twice"):
        parse_seeds(["index_tip=1,2", "index_tip=1,3"])


@pytest.mark.parametrize(
    ("seeds", "method", "why"),
    [
        ({}, "dots", "no seeds: say where"),
        ({"index_tip": (700.0, 3.0)}, "dots", "lies outside the picture, which is 640x480"),
        ({"index_wrist": (7.0, 3.0)}, "dots", "are of no finger"),
        ({"index_tip": (7.0, 3.0)}, "dots", "seeds missing for index_mcp, index_pip, index_dip"),
        ({k: v for k, v in FOUR.items() if k != "index_dip"}, "edges", "missing for index_dip"),
    ],
)
def test_seeds_that_will_not_do(seeds, method, why):
    with pytest.raises(CaptureError, match=why):
        check_seeds(seeds, (640, 480), method)


def test_what_is_missing_and_can_be_done_without_is_noted():
    three = {place: at for place, at in FOUR.items() if place != "index_tip"}
    check_seeds(three, (640, 480), "dots")
    notes = missing_notes(three, has_base=False)["index"]
    assert notes[0].startswith("no seed for index_tip")
    assert notes[1].startswith("no base line")
    assert missing_notes(FOUR, has_base=True) == {"index": []}


def test_edges_have_their_base_regions_between_wrist_and_knuckle():
    seeds = {**FOUR, "index_wrist": (0.0, 80.0)}
    assert for_method(seeds, "dots") == seeds
    regions = for_method(seeds, "edges")
    assert regions["index_b1"] == (0.0, 80.0)
    assert regions["index_b2"] == (80.0, 80.0)
    assert "index_wrist" not in regions
    assert for_method(regions, "edges") == regions


def test_metres_for_millimetres():
    with pytest.raises(CaptureError, match=r"metres were given: write 43.6"):
        parse_lengths(["index_proximal_mm=0.0436"])
    with pytest.raises(CaptureError, match="metres were given"):
        known_scale(0.00045, {"proximal": 90.0})
    with pytest.raises(CaptureError, match=r"4360 mm; they are 5 to 95 mm long$"):
        parse_lengths(["index_proximal_mm=4360"])


@pytest.mark.parametrize("text", ["index=4", "index_nail_mm=4", "index_distal_mm=e"])
def test_a_length_that_is_none(text):
    with pytest.raises(CaptureError, match="--length"):
        parse_lengths([text])


def test_two_lengths_share_their_disagreement():
    measured = {("index", "mcp"): (80.0, 0.1), ("index", "pip"): (50.0, 0.1)}
    scale = scale_of_lengths({("index", "mcp"): 40.0, ("index", "pip"): 25.5}, measured)
    assert 0.5 < scale.per_px < 0.51
    assert scale.sigma > 0.005
    with pytest.raises(CaptureError, match="index_distal was not seen"):
        scale_of_lengths({("index", "dip"): 18.0}, measured)
