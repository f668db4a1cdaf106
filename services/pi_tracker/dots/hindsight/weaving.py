"""The likeliest way through several accounts of a recording, from one to another where they agree.

Pure. Searches err at different pictures. Where two accounts give all dots the same patches for some
pictures, what was before and what comes after may be of either: each account goes on from whatever
was the likeliest until there (as Viterbi's algorithm does, over accounts instead of states).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from services.pi_tracker.dots.evidence import Judge, Told, Trace
from services.pi_tracker.dots.hypothesis import Way

# Dots' patches of some pictures, by their numbers.
Account = Mapping[int, Told]

# An account goes on from the past of another with which it agrees in so many pictures in a row: two
# postures with the same names need some to show which of them is right. (4, 8 and 15 pictures, ten
# clips of `grab`, seeds 5 to 29 of benchmarks/dots.py: 99.36, 99.34 and 99.48 % right.)
AGREED = 15


class _Thread(NamedTuple):
    """A way through accounts until a picture, and what is known after it."""

    way: Way
    trace: Trace


def woven(judge: Judge, accounts: Sequence[Account], count: int) -> list[Told]:
    """Dots' patches of `count` pictures; the first account has all of them, and the right start."""
    first = accounts[0][0]
    begun = _Thread(Way(None, first), judge.begin(first))
    threads = {k: begun for k, own in enumerate(accounts) if own.get(0) == first}
    for number in range(1, count):
        threads = _extended(judge, accounts, threads, number)
        threads |= _joined(accounts, threads, number)
    way: Way | None = _likeliest(list(threads.values())).way
    told: list[Told] = []
    while way is not None:
        told.append(way.patch)
        way = way.before
    return told[::-1]


def _extended(
    judge: Judge, accounts: Sequence[Account], threads: Mapping[int, _Thread], number: int
) -> dict[int, _Thread]:
    """The thread of each account after the next picture; none of an account that ends."""
    known: dict[tuple[int, Told], _Thread] = {}
    found = {}
    for k, thread in threads.items():
        told = accounts[k].get(number)
        if told is None:
            continue
        same = id(thread), told
        if same not in known:
            known[same] = _Thread(Way(thread.way, told), judge.follow(thread.trace, number, told))
        found[k] = known[same]
    return found


def _joined(
    accounts: Sequence[Account], threads: Mapping[int, _Thread], number: int
) -> dict[int, _Thread]:
    """The likeliest thread of those that agree, for each account that agrees with any."""
    alike: dict[tuple[Told | None, ...], list[int]] = {}
    for k, own in enumerate(accounts):
        late = tuple(own.get(number - back) for back in range(min(AGREED, number + 1)))
        if None not in late:
            alike.setdefault(late, []).append(k)
    found: dict[int, _Thread] = {}
    for same in alike.values():
        there = [threads[k] for k in same if k in threads]
        if there:
            found |= dict.fromkeys(same, _likeliest(there))
    return found


def _likeliest(threads: Sequence[_Thread]) -> _Thread:
    return max(threads, key=lambda one: one.trace.nats)
