"""When messages are due, and which of a recording are played."""

from __future__ import annotations

import math

import pytest

from rhot.errors import CaptureError
from services.recorder.pace import LONGEST_GAP_NS, Pace, window
from services.recorder.reader import Summary

MS = 1_000_000
SUMMARY = Summary("desk", 3, start_ns=10**18, end_ns=10**18 + 8 * 10**9, keys={})


def test_due_times_follow_the_recording_and_do_not_drift() -> None:
    pace = Pace(2.0)
    assert pace.due_ns(1000 * MS, 5 * MS) == 5 * MS
    # However late each one was asked for.
    for step in range(1, 1000):
        assert pace.due_ns((1000 + 7 * step) * MS, 5 * MS + step * MS) == (5 + 3.5 * step) * MS


def test_asked_twice_it_says_the_same() -> None:
    pace = Pace(1.0)
    pace.due_ns(0, 0)
    far = LONGEST_GAP_NS * 3
    assert [pace.due_ns(far, 7) for _ in range(3)] == [LONGEST_GAP_NS] * 3
    assert pace.due_ns(far + 5, 7) == LONGEST_GAP_NS + 5


def test_after_a_pause_or_a_sleep_the_next_is_due_at_once() -> None:
    pace = Pace(1.0)
    pace.due_ns(0, 0)
    pace.begin()
    assert pace.due_ns(50 * MS, 900 * MS) == 900 * MS
    assert pace.due_ns(60 * MS, 900 * MS) == 910 * MS
    # Asleep for a minute: not a minute's messages in one burst.
    assert pace.due_ns(70 * MS, 60_000 * MS) == 60_000 * MS
    assert pace.due_ns(80 * MS, 60_000 * MS) == 60_010 * MS


def test_flat_out_everything_is_due() -> None:
    pace = Pace(0.0)
    assert [pace.due_ns(t * 10**9, 3) for t in range(5)] == [3] * 5


@pytest.mark.parametrize("rate", [-1.0, math.nan, math.inf])
def test_rates_that_cannot_be(rate: float) -> None:
    with pytest.raises(CaptureError, match="1 is real time"):
        Pace(rate)


@pytest.mark.parametrize(
    ("from_s", "to_s", "expected_s"),
    [
        (None, None, (0.0, 8.0)),
        (2.5, None, (2.5, 8.0)),
        (None, 3.0, (0.0, 3.0)),
        (-3.0, -1.0, (5.0, 7.0)),
        (-100.0, 100.0, (0.0, 8.0)),
        (8.0, 8.0, (8.0, 8.0)),
    ],
)
def test_windows(from_s: float | None, to_s: float | None, expected_s: tuple[float, float]) -> None:
    start_ns, end_ns = window(SUMMARY, from_s, to_s)
    assert ((start_ns - 10**18) * 1e-9, (end_ns - 10**18) * 1e-9) == expected_s


@pytest.mark.parametrize(
    ("from_s", "to_s"), [(9.0, None), (None, -9.0), (5.0, 4.0), (math.nan, None), (-1.0, 2.0)]
)
def test_empty_windows(from_s: float | None, to_s: float | None) -> None:
    with pytest.raises(CaptureError, match="--from"):
        window(SUMMARY, from_s, to_s)
