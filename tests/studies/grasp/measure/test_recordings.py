"""Joints in pixels become angles, lengths and points in the finger's plane, with their sigmas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.measure.joints import Place, Seen, base_places, joints_of
from studies.grasp.measure.plane import Segment, turn
from studies.grasp.measure.recordings import Wanted, recordings

LENGTHS = (80.0, 50.0, 35.0)
NAMES = ("index_mcp", "index_pip", "index_dip", "index_tip")


def seen(angles_deg, frame=0, *, side=1, at=(300.0, 200.0), hand_deg=10.0, sigma=0.2, base=True):
    """A finger on the screen; side 1: it closes clockwise."""
    direction, point = math.radians(hand_deg), np.array(at)
    back = np.array([math.cos(direction), math.sin(direction)])
    places = {"index_wrist": Place(*(point - 120.0 * back), sigma)} if base else {}
    places[NAMES[0]] = Place(*point, sigma)
    for name, length, angle in zip(NAMES[1:], LENGTHS, np.radians(angles_deg), strict=True):
        direction += side * angle
        point = point + length * np.array([math.cos(direction), math.sin(direction)])
        places[name] = Place(*point, sigma)
    return Seen(frame, frame / 30.0, places, {})


def measured(pictures, wanted=None, notes=None, names=("index_wrist", *NAMES)):
    return recordings(pictures, names, wanted or Wanted(), "dots", notes or {})


CLOSING = [(5.0 + 2.0 * k, 10.0 + 2.5 * k, 5.0 + 1.7 * k) for k in range(37)]


@pytest.mark.parametrize("side", [1, -1])
def test_angles_are_those_of_the_finger_whichever_way_it_closes(side):
    pictures = [seen(angles, k, side=side) for k, angles in enumerate(CLOSING)]
    recording = measured(pictures)["index"].recording
    assert ("counterclockwise" in recording.notes[1]) == (side < 0)
    for frame, angles in zip(recording.frames, CLOSING, strict=True):
        told = [math.degrees(frame.angles_rad[joint]) for joint in ("mcp", "pip", "dip")]
        assert told == pytest.approx(angles, abs=1e-3)
        assert math.degrees(frame.tip_direction_rad) == pytest.approx(sum(angles), abs=1e-3)
        x, y = frame.points["pip"]
        mcp = math.radians(angles[0])
        assert (x, y) == pytest.approx((80.0 * math.cos(mcp), 80.0 * math.sin(mcp)), abs=1e-3)
        assert frame.confidence == 1.0


def test_sigmas_are_those_of_repeated_measurements():
    rng = np.random.default_rng(4)
    exact = seen((30.0, 60.0, 40.0), sigma=0.5)
    told = measured([exact])["index"].recording.frames[0]
    angles, tips = [], []
    for _ in range(800):
        moved = {
            name: place._replace(
                x_px=place.x_px + rng.normal(0.0, 0.5), y_px=place.y_px + rng.normal(0.0, 0.5)
            )
            for name, place in exact.places.items()
        }
        frame = measured([exact._replace(places=moved)])["index"].recording.frames[0]
        angles.append([frame.angles_rad[joint] for joint in ("mcp", "pip", "dip")])
        tips.append(frame.points["tip"])
    spread = np.std(angles, axis=0)
    sigmas = [told.angles_sigma_rad[joint] for joint in ("mcp", "pip", "dip")]
    assert sigmas == pytest.approx(spread, rel=0.1)
    assert told.points_sigma["tip"] == pytest.approx(np.sqrt(np.var(tips, axis=0).mean()), rel=0.1)


def test_a_joint_out_of_view_costs_what_needs_it_and_says_so():
    whole = seen((20.0, 40.0, 30.0))
    places = {name: place for name, place in whole.places.items() if name != "index_tip"}
    cut = Seen(1, 1 / 30, places, {"index_tip": "out of view"})
    frame = measured([whole, cut])["index"].recording.frames[1]
    assert set(frame.angles_rad) == {"mcp", "pip"}
    assert set(frame.points) == {"mcp", "pip", "dip"}
    assert frame.tip_direction_rad is None
    assert frame.note == "index_tip: out of view"
    assert frame.confidence == pytest.approx(0.8)


def test_without_a_base_line_pip_and_dip_are_measured():
    pictures = [seen(angles, k, base=False) for k, angles in enumerate(CLOSING)]
    recording = measured(pictures, names=NAMES)["index"].recording
    assert set(recording.frames[3].angles_rad) == {"pip", "dip"}
    assert recording.frames[3].points == {}
    given = measured(pictures, Wanted(base=(0.0, 0.0, 98.48, 17.365)), names=NAMES)["index"]
    assert math.degrees(given.recording.frames[3].angles_rad["mcp"]) == pytest.approx(11, abs=0.01)
    assert "base line: given, at rest in the picture" in given.recording.notes


def test_the_thumb_has_its_own_joints_and_the_index_fingers_base_line():
    assert list(joints_of("thumb").values()) == ["thumb_cmc", "thumb_mp", "thumb_ip", "thumb_tip"]
    assert base_places("thumb") == base_places("index")
    eight = {**seen((20.0, 40.0, 30.0), base=False).places}
    for name, at in zip(
        joints_of("thumb").values(), ((150, 230), (200, 290), (230, 330), (250, 360)), strict=True
    ):
        eight[name] = Place(*map(float, at), 0.2)
    found = measured([Seen(0, 0.0, eight, {})], names=list(eight))
    assert set(found) == {"index", "thumb"}
    assert found["index"].plan.base == Segment("thumb_cmc", "index_mcp")
    assert set(found["thumb"].recording.frames[0].angles_rad) == {"mcp", "pip", "dip"}


def test_lengths_come_from_a_known_bone():
    pictures = [seen(angles, k) for k, angles in enumerate(CLOSING)]
    wanted = Wanted(lengths_mm={("index", "mcp"): 40.0})
    recording = measured(pictures, wanted)["index"].recording
    assert recording.unit == "mm"
    assert recording.lengths == pytest.approx((40.0, 25.0, 17.5), abs=1e-3)
    without = measured(pictures)["index"].recording
    assert without.unit == "px"
    assert any("no reference length" in note for note in without.notes)


def test_bones_by_edges_are_as_sure_as_the_joints_at_their_ends():
    pictures = [seen(angles, k) for k, angles in enumerate(CLOSING)]
    names = ("index_wrist", *NAMES)
    recording = recordings(pictures, names, Wanted(), "edges", {})["index"].recording
    # Each place of these pictures is known to 0.2 px.
    assert recording.lengths_sigma == pytest.approx((0.2 * 2**0.5,) * 3, abs=1e-3)
    assert any("as long as all pictures together say" in note for note in recording.notes)


def test_a_phalanx_that_shrinks_is_doubted():
    pictures = [seen(angles, k) for k, angles in enumerate(CLOSING)]
    pip, dip = pictures[5].places["index_pip"], pictures[5].places["index_dip"]
    half = Place(0.5 * (pip.x_px + dip.x_px), 0.5 * (pip.y_px + dip.y_px), 0.2)
    pictures[5] = pictures[5]._replace(places={**pictures[5].places, "index_dip": half})
    frame = measured(pictures)["index"].recording.frames[5]
    assert "middle phalanx looks -50 % long" in frame.note
    assert frame.confidence == 0.5


def test_no_hand_is_told():
    with pytest.raises(CaptureError, match="no hand: in none of 3 pictures"):
        measured([Seen(k, 0.0, {}, {}) for k in range(3)])


def test_a_segment_without_length_has_no_direction():
    same = {"a": Place(1, 1, 1.0), "b": Place(2, 1, 1.0), "c": Place(50, 1, 1.0)}
    assert turn(Segment("a", "b"), Segment("b", "c"), same) is None
