"""What is wrong stands at the top of the page, with what to do, and harmless."""

from __future__ import annotations

from rhot.watch.rig_state import StandingFault
from services.viewer.panel.fault_texts import faults
from testing.sample_health import NOW_NS, fault

EVIL = '<script>alert("x")</script><img src=x onerror=alert(1)>\x1b[2J'


def standing(*found):
    return [StandingFault(teller="fusion", fault=one) for one in found]


def test_nothing_is_said_while_all_is_well():
    assert faults([], NOW_NS) == ""


def test_what_since_when_and_what_to_do():
    said = faults(standing(fault("camera_moved", "left has moved", "left", since_s=75)), NOW_NS)
    assert "error" in said
    assert "fusion: left has moved, for 75 s" in said
    assert "rhot calibrate stereo" in said
    assert "[camera_moved]" in said
    assert "for 5 min" in faults(standing(fault("event", since_s=300)), NOW_NS)
    # A sender's clock that is ahead says nothing of how long it lasts.
    assert (
        "for" not in faults(standing(fault("disk_low", "low", since_s=-60)), NOW_NS).split("→")[0]
    )


def test_strangers_cannot_write_html():
    evil = [
        StandingFault(teller=EVIL, fault=fault("event", EVIL, EVIL)),
    ]
    said = faults(evil, NOW_NS)
    assert "<script" not in said
    assert "<img" not in said
    assert "\x1b" not in said


def test_what_is_too_much_is_counted():
    said = faults(standing(*(fault("event", str(n)) for n in range(30))), NOW_NS)
    assert "22 more" in said
