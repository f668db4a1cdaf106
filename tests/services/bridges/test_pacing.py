"""What goes out, and how often."""

from __future__ import annotations

import msgspec
import pytest

from services.bridges.pacing import HOLD_S, Newest, Pacer
from testing.sample_hands import object_pose, random_pose


def test_a_hand_counts_until_it_is_lost():
    newest = Newest(10.0)
    pose = random_pose("left", 1)
    newest.hand(random_pose("left", 0), 10.0)
    newest.hand(pose, 10.1)
    assert newest.frame(10.2) == (pytest.approx(0.2), {"left": pose}, {})
    assert newest.frame(10.1 + HOLD_S + 1e-6).hands == {}
    newest.hand(pose, 11.0)
    assert newest.frame(11.0).hands == {"left": pose}


def test_an_object_that_is_lost_or_not_registered_does_not_count():
    newest = Newest(0.0)
    cup = object_pose("cup")
    for state in ({"tracking": "lost"}, {"tracking": "unregistered", "registered": False}):
        newest.object(cup, 0.0)
        assert newest.frame(0.0).objects == {"cup": cup}
        newest.object(msgspec.structs.replace(cup, **state), 0.0)
        assert newest.frame(0.0).objects == {}


def test_names_from_the_network_do_not_pile_up():
    newest = Newest(0.0)
    for number in range(1000):
        newest.object(object_pose(f"o{number}"), 0.0)
    assert len(newest.frame(0.0).objects) == 64


@pytest.mark.parametrize(
    ("arrivals_hz", "rate_hz", "sent_hz"), [(200.0, 60.0, 60), (30.0, 60.0, 30), (90.0, 60.0, 60)]
)
def test_the_rate_is_kept_and_never_exceeded(arrivals_hz, rate_hz, sent_hz):
    pacer, sent, now_s = Pacer(rate_hz), [], 0.0
    for number in range(int(10 * arrivals_hz)):
        # Whatever came while the frame before waited is skipped.
        if number / arrivals_hz < now_s:
            continue
        now_s = number / arrivals_hz
        now_s += pacer.wait_s(now_s)
        pacer.went(now_s)
        sent.append(now_s)
    assert len(sent) == pytest.approx(10 * sent_hz, rel=0.02)
    for first in range(len(sent)):
        within = sum(sent[first] <= one < sent[first] + 1.0 for one in sent[first:])
        assert within <= rate_hz + 1
