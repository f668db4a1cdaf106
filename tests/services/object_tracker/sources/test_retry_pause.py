"""Pauses between tries."""

from __future__ import annotations

from services.object_tracker.sources.retry_pause import RetryPause


def test_pauses_grow_to_half_a_minute_and_begin_anew() -> None:
    pause = RetryPause()
    assert [pause.after_failure() for _ in range(7)] == [1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0]
    pause.succeeded()
    assert pause.after_failure() == 1.0
