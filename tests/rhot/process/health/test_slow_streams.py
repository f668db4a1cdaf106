"""A slow stream is a fault after three beats, and none any more after three good ones."""

from __future__ import annotations

from rhot.messages.health import StreamHealth
from rhot.process.health.slow_streams import SlowStreams


def stream(rate_hz: float, dropped: int = 0) -> StreamHealth:
    return StreamHealth(
        key="camera/left/markers",
        direction="in",
        count=0,
        rate_hz=rate_hz,
        expected_hz=30.0,
        ok=rate_hz >= 24.0,
        dropped=dropped,
        rejected=0,
        latency_p50_ms=-1.0,
        latency_p99_ms=-1.0,
    )


def test_begins_after_three_slow_beats_and_ends_after_three_good_ones():
    slow = SlowStreams()
    named = [bool(slow.beat([stream(rate)])) for rate in (30, 5, 5, 5, 30, 5, 30, 30, 30, 5)]
    assert named == [False] * 3 + [True] * 5 + [False] * 2


def test_the_text_says_which_and_how_slow():
    slow = SlowStreams()
    for _ in range(3):
        texts = slow.beat([stream(12.0, dropped=4)])
    assert texts == {
        "in camera/left/markers": (
            "camera/left/markers: 12.0 Hz received of 30.0 expected, 4 dropped"
        )
    }
    assert slow.any_slow


def test_a_stream_that_is_closed_is_over():
    slow = SlowStreams()
    for _ in range(3):
        slow.beat([stream(0.0)])
    assert slow.beat([]) == {}
    assert not slow.any_slow
