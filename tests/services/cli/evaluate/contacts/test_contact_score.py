"""Scores of touches and grasps, with errors that are known."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.messages import FingerAngles, WristPose
from rhot.messages.objects import Contact, Grasp, ObjectContacts
from rhot.messages.simulator import HandTruth, ObjectTruth, Truth
from services.cli.evaluate.contacts.contact_score import contact_score, true_touches

START, MS = 10**18, 1_000_000
STILL = (1.0, 0.0, 0.0, 0.0)
ANGLES = {"index": FingerAngles(abduction=0.0, mcp=0.0, pip=0.0, dip=0.0)}


def at(milliseconds):
    return START + milliseconds * MS


def lines(held=(1100, 1900), far_m=None):
    """The index finger comes at 100 mm/s, touches from 1 s to 2 s, and leaves."""
    wrist = WristPose(position_m=(0.0, 0.0, 0.0), orientation_wxyz=STILL)
    made = []
    for ms in range(0, 3000, 20):
        gap = 1e-4 * max(0, 1000 - ms, ms - 2000) if far_m is None else far_m
        cup = ObjectTruth(
            position_m=(0.0, 0.0, 0.0),
            orientation_wxyz=STILL,
            contacts={"right.index": gap},
            held_by="right" if held[0] <= ms < held[1] else "",
        )
        hand = HandTruth(points_m={}, wrist=wrist, angles_rad=ANGLES)
        made.append(Truth(stamp_ns=at(ms), hands={"right": hand}, objects={"cup": cup}))
    return made


def messages(*touches, grasps=()):
    """Every 20 ms, with touches and grasps as (begin, end) in ms."""
    made = []
    for ms in range(0, 3000, 20):
        current = [one for one in touches if one[0] <= ms < one[1]]
        over = [one for one in touches if one[1] <= ms]
        held = [one for one in grasps if one[0] <= ms < one[1]]
        ended = [one for one in grasps if one[1] <= ms]
        contact = Contact(
            hand="right",
            part="index",
            distance_m=0.0,
            sigma_m=0.001,
            point_m=(0.0, 0.0, 0.0),
            touching=bool(current),
            since_ns=at(current[0][0]) if current else 0,
            until_ns=at(over[-1][1]) if over else 0,
        )
        made.append(
            ObjectContacts(
                object="cup",
                seq=ms,
                stamp_ns=at(ms),
                contacts=[contact],
                grasps=[Grasp(hand="right", parts=["index"], since_ns=at(a)) for a, _ in held],
                ended=[
                    Grasp(hand="right", parts=["index"], since_ns=at(a), until_ns=at(b))
                    for a, b in ended[-1:]
                ],
            )
        )
    return made


def test_true_touches_lie_between_the_lines():
    stamps = START + np.arange(5) * 100 * MS
    spans = true_touches(stamps, np.array([0.0105, 0.0, 0.0, 0.0, 0.004]))
    # 0.5 mm is crossed ten elevenths.. of the way down, 1 mm a quarter of the way up.
    assert (spans[0].begin_ns - START) / MS == pytest.approx(95.2, abs=0.1)
    assert (spans[0].end_ns - START) / MS == pytest.approx(325.0, abs=0.1)


def test_errors_in_time_and_in_true_distance():
    score = contact_score(lines(), messages((1030, 2020)), "cup").touches
    assert (score.true, score.found, score.missed, score.false) == (1, 1, 0, 0)
    # The truth begins at 995 ms and ends at 2010 ms.
    assert score.begin_ms[0] == pytest.approx(35.0, abs=0.1)
    assert score.end_ms[0] == pytest.approx(10.0, abs=0.1)
    assert score.begin_mm[0] == pytest.approx(0.0, abs=0.01)
    assert score.end_mm[0] == pytest.approx(2.0, abs=0.01)
    assert score.within_share == 1.0


@pytest.mark.parametrize(
    ("span", "share"), [((940, 2010), 0.5), ((995, 2090), 0.5), ((900, 2200), 0.0)]
)
def test_what_is_late_or_far_is_not_within(span, share):
    assert contact_score(lines(), messages(span), "cup").touches.within_share == share


def test_missed_split_and_false_touches():
    assert contact_score(lines(), messages(), "cup").touches.missed == 1
    split = contact_score(lines(), messages((995, 1400), (1500, 2010)), "cup").touches
    assert (split.found, split.false) == (1, 1)
    far = contact_score(lines(far_m=0.01), messages((500, 900)), "cup").touches
    assert (far.true, far.false, far.near) == (0, 1, 0)
    near = contact_score(lines(far_m=0.002), messages((500, 900)), "cup").touches
    assert (near.false, near.near) == (0, 1)


def test_grasps_right_missed_and_false():
    right = contact_score(lines(), messages(grasps=[(1050, 1950)]), "cup").grasps
    assert (right.true, right.right, right.missed, right.false) == (1, 1, 0, 0)
    assert right.begin_ms[0] == pytest.approx(50.0, abs=0.1)
    assert contact_score(lines(), messages(), "cup").grasps.missed == 1
    twice = contact_score(lines(), messages(grasps=[(1050, 1300), (1500, 1950)]), "cup").grasps
    assert (twice.right, twice.false) == (1, 1)


def test_an_object_without_a_shape_has_no_score():
    bare = [
        Truth(
            stamp_ns=at(0),
            hands={},
            objects={"cup": ObjectTruth(position_m=(0.0, 0.0, 0.0), orientation_wxyz=STILL)},
        )
    ]
    assert contact_score(bare, [], "cup") is None
