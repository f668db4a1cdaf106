"""Names of universes, and what events say of the frame."""

from __future__ import annotations

import pytest

from rhot.messages.objects import OpenVrEvent
from services.object_tracker.intake.frames import FrameWatch


@pytest.mark.parametrize(
    ("registered", "universe", "holds"),
    [
        ("raw:1", "raw:1", True),
        ("raw:1", "raw:12", False),
        ("raw:1", "raw", True),
        ("raw", "raw:1", True),
        ("libsurvive", "raw", False),
        ("raw:1", "", True),
        ("", "anything", True),
    ],
)
def test_names(registered: str, universe: str, holds: bool) -> None:
    assert FrameWatch(registered).holds("LHR-1", universe) is holds


def test_one_device_elsewhere_does_not_concern_the_others() -> None:
    frames = FrameWatch("raw:1")
    assert not frames.holds("LHR-1", "libsurvive")
    assert frames.holds("LHR-2", "raw:1")
    # Nothing tells that the frame it came back to is the old one.
    assert not frames.holds("LHR-1", "raw:1")
    assert frames.texts() == {
        "LHR-1": "LHR-1 is now in universe 'libsurvive', registered was 'raw:1'"
    }


def test_the_universe_that_moved_concerns_all() -> None:
    frames = FrameWatch("raw:1")
    assert frames.event(OpenVrEvent(v=1, stamp_ns=1, event_type=801, name="X")) is None
    assert not frames.holds("LHR-1", "raw:1")
    assert "801" in frames.texts()[""]


def test_long_names_of_strangers_make_short_texts() -> None:
    frames = FrameWatch("a" * 10_000)
    frames.holds("LHR-1", "b" * 10_000)
    assert len(frames.texts()["LHR-1"]) < 200
