"""The order of one serial's messages. (Whole streams of poses are in ../test_streams.py.)"""

from __future__ import annotations

import pytest

from services.object_tracker.intake.order import MessageOrder

MS = 1_000_000
T0 = 10**18


def judged(order: MessageOrder, seq: int, at_ms: float, arrival_ms: float | None = None) -> str:
    arrival_ns = None if arrival_ms is None else T0 + round(arrival_ms * MS)
    return order.judge(seq, T0 + round(at_ms * MS), arrival_ns)


def test_overtaken_messages_of_one_sender_are_not_a_second_one() -> None:
    order = MessageOrder()
    for seq in range(0, 400, 2):
        assert judged(order, seq + 1, seq + 1, seq + 1) == "next"
        assert judged(order, seq, seq, seq + 1.5) == "out_of_order"
    assert not order.twice(T0 + 400 * MS)


def test_lost_messages_and_large_steps_are_no_second_sender() -> None:
    order = MessageOrder()
    seq = 0
    for k in range(200):
        seq += 1 + 200 * (k % 7 == 0)
        assert judged(order, seq, 4 * k, 4 * k) == "next"
    counted_in_ns = MessageOrder()
    for k in range(200):
        assert judged(counted_in_ns, 4 * k * MS, 4 * k, 4 * k) == "next"


def test_a_sender_that_does_not_count_is_one_sender() -> None:
    order = MessageOrder()
    assert {judged(order, 7, 4 * k, 4 * k) for k in range(100)} == {"next"}


def test_files_have_no_arrivals_and_may_pause() -> None:
    order = MessageOrder()
    for k in range(100):
        pause_ms = 60_000 if k >= 50 else 0
        assert judged(order, k, 4 * k + pause_ms) == "next"
    assert judged(order, 100, 10) == "out_of_order"


@pytest.mark.parametrize("ahead", [True, False])
def test_a_second_sender_far_away_in_seq_is_left_out_whatever_its_clock(ahead: bool) -> None:
    order = MessageOrder()
    for k in range(200):
        assert judged(order, 10_000 + k, 4 * k, 4 * k) == "next"
        if k < 2:
            continue  # which was first shows once it has counted
        theirs = 4 * k + (2 if ahead else -500)
        assert judged(order, 90_000 + k, theirs, 4 * k + 2) in ("second_sender", "out_of_order")
    assert order.twice(T0 + 800 * MS)
    assert not order.twice(T0 + 6000 * MS)


def test_a_replay_beside_the_stream_never_takes_over() -> None:
    order = MessageOrder()
    for k in range(1000):
        assert judged(order, k, 4 * k, 4 * k) == "next"
    # The sender has stopped; what it sent is sent again, for a minute.
    verdicts = {judged(order, k % 1000, 4 * (k % 1000), 4000 + 4 * k) for k in range(15_000)}
    assert verdicts <= {"out_of_order", "repeated"}
