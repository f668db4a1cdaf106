"""An overloaded reader answers in time, and a burst loses nothing."""

from __future__ import annotations

from collections import deque

import pytest

from rhot.bus.intake.standing_queue import StandingQueue


def read(arrivals_s, step_s, stalls=(), capacity=64):
    """Ages of what is answered and how many are skipped or dropped, by a reader of step_s each.

    stalls: (from, until) s at which it does nothing.
    """
    queue, waiting, now_s = StandingQueue(), deque(), 0.0
    coming = deque(arrivals_s)
    ages, lost = [], 0
    while coming or waiting:
        if not waiting:
            now_s = max(now_s, coming[0])
        for begin_s, end_s in stalls:
            if begin_s <= now_s < end_s:
                now_s = end_s
        while coming and coming[0] <= now_s:
            waiting.append(coming.popleft())
            if len(waiting) > capacity:
                waiting.popleft()
                lost += 1
        came_s = waiting.popleft()
        if queue.skips(now_s - came_s, now_s):
            lost += 1
            continue
        ages.append((came_s, now_s - came_s))
        now_s += step_s
    return ages, lost


def frames(seconds, rate_hz=60.0):
    return [k / rate_hz for k in range(int(seconds * rate_hz))]


def test_a_stall_shorter_than_the_queue_loses_nothing():
    ages, lost = read(frames(5.0), 0.005, stalls=[(1.0, 1.9)])
    assert lost == 0
    assert len(ages) == 300
    assert max(age for _, age in ages) == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize("overload", [1.1, 2.0, 4.0])
def test_an_overloaded_reader_answers_in_time_and_as_much_as_it_can(overload):
    step_s = overload / 60.0
    ages, lost = read(frames(30.0), step_s)
    settled = [age for came_s, age in ages if came_s > 15.0]
    assert max(settled) < 0.2
    # It is never idle: what is skipped is what it could not have done.
    assert len(ages) >= 0.97 * 30.0 / step_s
    assert len(ages) + lost == 1800
    # Without it every answer was as late as the queue is long.
    assert 64 * step_s > 1.0


def test_an_overload_that_is_over_is_forgotten():
    busy, calm = frames(10.0, 120.0), [10.0 + one for one in frames(5.0, 30.0)]
    ages, _ = read(busy + calm, 1.0 / 60.0)
    after = [age for came_s, age in ages if came_s >= 11.0]
    assert len(after) == 120
    assert max(after) < 0.02
