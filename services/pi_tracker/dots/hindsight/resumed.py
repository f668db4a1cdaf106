"""Searches that go on from where an account has the hand, forwards and backwards. Pure.

Where names are lost, at a jerk or in a fist, they were right until then, and retraced they tell the
hand's posture there better than the search knew that lost them (evidence.py). A wider search that
goes on from this posture may find the way. What makes all pictures likelier is believed, and
searched on from in turn, until nothing more is found.
"""

from __future__ import annotations

from collections.abc import Callable

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.evidence import Judge, Told, Trace
from services.pi_tracker.dots.extend import searched_on
from services.pi_tracker.dots.hindsight.weaving import AGREED, Account, woven
from services.pi_tracker.dots.hypothesis import Hypothesis, Surroundings, Way
from services.pi_tracker.dots.search import Search

# As where one may be lost: one in so many pictures is begun with.
_EVERY = 20
# A search ends where it agrees again with what was believed, after the least number of pictures or
# later, or with the most.
_LEAST, _MOST = 30, 160
# Rounds at most.
_ROUNDS = 4
# Partial assignments are what a search lacks at a jerk. (15 dots of `grab`, seed 3 of
# benchmarks/dots.py, a fist that opens within 4 pictures, from right postures before and after: 48,
# and 96 with twice as many accounts, lose both ways, 192 none for good, in as much time.)
_WIDE = Search(beam=192)
# How often each picture is looked at: in each round forwards and backwards.
LOOKS = 2 * _ROUNDS

# Where a search has begun, and what was believed of the pictures until there.
_Start = tuple[int, tuple[Told, ...]]


def resumed(judge: Judge, told: list[Told], advance: Callable[[], None]) -> list[Told]:
    """An account of all pictures that is likelier than `told`, or that itself.

    advance is called LOOKS times for each picture.
    """
    count, left = len(told), LOOKS * len(told)
    ahead, behind = set[_Start](), set[_Start]()
    for _ in range(_ROUNDS):
        forwards, last = _searched(judge, told, ahead, advance)
        backwards, _ = _searched(judge.backwards(last), told[::-1], behind, advance)
        left -= 2 * count
        turned = [{count - 1 - k: own for k, own in account.items()} for account in backwards]
        better = woven(judge, [dict(enumerate(told)), *forwards, *turned], count)
        if better == told:
            break
        told = better
    for _ in range(left):
        advance()
    return told


def _searched(
    judge: Judge, told: list[Told], known: set[_Start], advance: Callable[[], None]
) -> tuple[list[Account], Trace]:
    """Accounts that differ from `told`, of searches whose start is not in `known`, which grows.

    And what is known after the last picture.
    """
    accounts: list[Account] = []
    trace: Trace
    for number, trace in enumerate(judge.retraced(told)):
        start = number, tuple(told[max(number - _LEAST, 0) : number + 1])
        if number % _EVERY == 0 and start not in known:
            known.add(start)
            found = _gone_on(judge, trace, number, told)
            if found != told[number : number + len(found)]:
                # What was believed until there, so that weaving goes on from it.
                first = max(number - AGREED + 1, 0)
                accounts.append(dict(enumerate(told[first:number] + found, first)))
        advance()
    return accounts, trace


def _gone_on(judge: Judge, trace: Trace, number: int, told: list[Told]) -> list[Told]:
    """Dots' patches of picture `number` and those that follow, searched on from a trace of it."""
    body, own = judge.body, told[number]
    scores = trace.scores - trace.nats
    hypotheses = [
        Hypothesis(
            score=float(scores[row]),
            state=trace.states.take([row]),
            branch=row,
            areas=trace.areas,
            unseen=trace.unseen,
            patch=own,
            before=own,
            false=trace.false,
            way=Way(None, own),
        )
        for row in range(len(scores))
    ]
    for k in range(number + 1, min(number + _MOST, len(told))):
        elapsed_s = motion.between(judge.times_s[k - 1], judge.times_s[k])
        levels = motion.levels(body, elapsed_s)
        around = Surroundings(body, levels, judge.false_density)
        hypotheses = searched_on(hypotheses, judge.pictures[k], around, elapsed_s, _WIDE)
        late = _last(hypotheses[0].way, AGREED)
        if k - number >= _LEAST and late == told[k - AGREED + 1 : k + 1]:
            break
    return _last(hypotheses[0].way, _MOST)


def _last(way: Way | None, most: int) -> list[Told]:
    """Dots' patches of the last pictures of a way."""
    found: list[Told] = []
    while way is not None and len(found) < most:
        found.append(way.patch)
        way = way.before
    return found[::-1]
