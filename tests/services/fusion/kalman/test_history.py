"""The memory of frames: in order of time, the oldest is forgotten."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.history import (
    empty_history,
    make_room,
    nodes_of,
    nodes_until,
    start_history,
)


def test_nodes_are_in_order_of_time():
    history = empty_history(2, 3, 16, 2)
    start_history(history, 0.0)
    for time_s in (0.3, 0.1, 0.2):
        node = history.order[make_room(history, nodes_until(history, time_s))]
        history.time_s[node] = time_s
    used = history.order[: history.size[0]]
    np.testing.assert_allclose(history.time_s[used], [0.0, 0.1, 0.2, 0.3])
    assert nodes_until(history, 0.15) == 2


def test_the_oldest_is_forgotten():
    history = empty_history(2, 3, 16, 2)
    start_history(history, 0.0)
    for k in range(1, 16 + 3):
        index = make_room(history, nodes_until(history, 0.1 * k))
        history.time_s[history.order[index]] = 0.1 * k
    assert history.size[0] == 16
    assert nodes_until(history, 0.25) == 0
    assert sorted(history.order) == list(range(16))


def test_what_is_kept_is_three_tenths_of_a_second_within_bounds():
    assert nodes_of(60.0) == 18  # two cameras at 30 fps
    assert nodes_of(30.0) == 16
    assert nodes_of(360.0) == 32
