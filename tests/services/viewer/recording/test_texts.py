"""What the recording tab says."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from rhot.messages.recording import RecorderState, Recording, Recordings, Replay
from services.viewer.recording import texts

NOW_NS = 10**18
REPLAY = Replay(
    name="a.mcap",
    rig="desk-replay",
    recorded_rig="desk",
    state="paused",
    at_s=1.0,
    duration_s=9.0,
    rate=1.0,
    loop=False,
)


def test_who_records_what() -> None:
    assert "rhot up" in texts.status(None, NOW_NS)
    assert "Nothing is being recorded" in texts.status(RecorderState(), NOW_NS)
    busy = RecorderState(file="x.mcap", since_ns=NOW_NS - 130 * 10**9, messages=7, size_mb=1.25)
    said = texts.status(busy, NOW_NS)
    assert "2 min 10 s, 7 messages, 1.2 MB" in said
    assert "x.mcap" in said
    assert "shows a recording" in texts.status(RecorderState(records=False), NOW_NS)


def test_what_went_wrong_is_text_not_markup() -> None:
    assert "&lt;b&gt;" in texts.status(RecorderState(note="<b>"), NOW_NS)
    assert "disk &amp; co" in texts.status(RecorderState(), NOW_NS, "disk & co")


def recording(name: str, state: Any = "whole") -> Recording:
    return Recording(name=name, state=state, size_mb=1.0, start_ns=NOW_NS, duration_s=75.0)


def test_only_whole_recordings_can_be_chosen_and_cut_ones_are_told() -> None:
    listed = Recordings(
        folder="/r",
        recordings=[
            recording("b.mcap"),
            recording("c.mcap", "recording"),
            recording("cut.mcap", "damaged"),
            recording("cut.recovered.mcap"),
            recording("bad.mcap", "damaged"),
        ],
        more=3,
    )
    labels = texts.labels(listed)
    assert list(labels.values()) == ["b.mcap", "cut.recovered.mcap"]
    assert next(iter(labels)) == "2001-09-09 01:46:40 UTC, 75 s (b.mcap)"
    said = texts.notes(listed)
    assert "rhot replay --recover bad.mcap" in said
    assert "cut.mcap was" not in said
    assert "3 older ones" in said
    assert texts.labels(None) == {}


def test_a_replay_has_a_page_of_its_own() -> None:
    assert "being opened" in texts.replay(REPLAY, "desk", "")
    said = texts.replay(REPLAY, "desk", 'http://h:1/?token="x')
    assert 'href="http://h:1/?token=&quot;x"' in said
    assert "paused" in said
    # On that page itself no link is needed.
    assert "href" not in texts.replay(REPLAY, "desk-replay", "")
    other = msgspec.structs.replace(REPLAY, recorded_rig="lab")
    assert "It is of rig lab" in texts.replay(other, "desk", "")


@pytest.mark.parametrize(("rate", "label"), [(1.0, "1"), (0.26, "1/4"), (16.0, "8")])
def test_rates(rate: float, label: str) -> None:
    assert texts.rate_label(rate) == label
