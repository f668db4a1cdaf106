"""A slow stream is a fault after three beats, and none any more after three good ones."""

from __future__ import annotations

from rhot.messages.health import StreamHealth
from rhot.process.health.slow_streams import SlowStreams


def stream(rate_hz: float, dropped: int = 0) -> StreamHealth:
    return StreamHealth(
        key="camera/left/markers",
        direction="in",
        count=round(rate_hz),
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
    for _ in range(4):
        texts = slow.beat([stream(12.0, dropped=4)])
    assert texts == {
        "in camera/left/markers": (
            "camera/left/markers: 12.0 a second received instead of 30.0, 4 dropped"
        )
    }
    assert slow.any_slow


def test_a_stream_that_is_closed_is_over():
    slow = SlowStreams()
    for rate_hz in (30, 0, 0, 0):
        slow.beat([stream(rate_hz)])
    assert slow.any_slow
    assert slow.beat([]) == {}
    assert not slow.any_slow


def test_one_that_has_just_begun_is_not_slow():
    slow = SlowStreams()
    # Cameras that start 10 s after fusion, and a first second of which half is over.
    assert not any(slow.beat([stream(rate)]) for rate in [0] * 10 + [14] + [30] * 5)
    assert not slow.any_slow


def test_one_that_never_begins_is_slow_after_twenty_beats():
    slow = SlowStreams()
    named = [bool(slow.beat([stream(0.0)])) for _ in range(21)]
    assert named == [False] * 19 + [True] * 2


def test_one_that_is_closed_and_comes_anew_begins_anew():
    slow = SlowStreams()
    for rate_hz in (30, 30):
        slow.beat([stream(rate_hz)])
    slow.beat([])
    assert not any(slow.beat([stream(0.0)]) for _ in range(10))
