"""Which master is followed, and what is said of a second one."""

from __future__ import annotations

from rhot.bus.clock_exchange import ClockExchange, MasterChoice, exchanges, several_masters
from rhot.bus.queries import Replies, Reply
from rhot.messages import ClockEcho


def answer(session: str, master_ns: int = 0, uptime_ns: int = 0, host: str = "") -> ClockExchange:
    echo = ClockEcho(master_ns=master_ns, session=session, uptime_ns=uptime_ns, host=host)
    return ClockExchange(100, 200, echo)


def test_the_first_master_is_followed_whatever_others_say():
    choice, first, second = MasterChoice(), answer("aa"), answer("bb", uptime_ns=10**12)
    assert choice.choose([first]) is first
    for answers in ([first, second], [second, first], [second, second, first]):
        assert choice.choose(answers) is first


def test_another_is_taken_once_the_first_is_gone_for_three_rounds():
    choice, first, second = MasterChoice(), answer("aa"), answer("bb")
    choice.choose([first])
    assert choice.choose([second]) is None
    assert choice.choose([]) is None
    assert choice.choose([second]) is second
    # The first one returns: it is another's now.
    assert choice.choose([first, second]) is second


def test_a_master_that_misses_a_round_stays():
    choice, first, second = MasterChoice(), answer("aa"), answer("bb")
    choice.choose([first])
    for _ in range(5):
        assert choice.choose([second]) is None
        assert choice.choose([second, first]) is first


def test_who_comes_later_agrees_with_those_who_were_there():
    older, younger = answer("ff", uptime_ns=10), answer("aa", uptime_ns=3)
    assert MasterChoice().choose([younger, older]) is older
    assert MasterChoice().choose([]) is None


def test_a_second_master_is_named_with_its_host_and_by_how_much_clocks_differ():
    one, two = answer("aa", 150, 20, "master"), answer("bb", 150 + 10**9, 10, "laptop")
    assert several_masters([one]) is None
    assert several_masters([one, one]) is None
    text = several_masters([two, one])
    assert text is not None
    assert "2 services" in text
    assert "master, laptop" in text
    assert "1000.0 ms" in text


def test_what_does_not_decode_is_no_answer():
    bad = [b"[" * 60_000, b"\xff", b"{}", b'{"master_ns":-1}', b'{"master_ns":1,"host":"a\\nb"}']
    replies = Replies(good=[Reply(payload, 5) for payload in [*bad, b'{"master_ns":7}']])
    assert [one.stamps for one in exchanges(3, replies)] == [(3, 7, 5)]
