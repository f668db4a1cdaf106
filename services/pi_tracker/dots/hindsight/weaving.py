"""The likeliest way through several accounts of a recording, from one to another where they agree.

Pure. Searches err at different pictures. Where two accounts give all dots the same patches for some
pictures, what was before and what comes after may be of either: each account goes on from whatever
was the likeliest until there (as Viterbi's algorithm does, over accounts instead of states). Of a
hand that is closed a dot or two show, and accounts never agree on whose they are: where no more
than two dots have a patch in one and none in the other, an account goes on from another's past,
too, if that is likelier by much.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from services.pi_tracker.dots.evidence import Judge, Told, Trace
from services.pi_tracker.dots.hypothesis import Way

# Dots' patches of some pictures, by their numbers.
Account = Mapping[int, Told]

# An account goes on from the past of another with which it agrees in so many pictures in a row: two
# postures with the same names need some to show which of them is right. (4, 8 and 15 pictures, ten
# clips of `grab`, seeds 5 to 29 of benchmarks/dots.py: 99.36, 99.34 and 99.48 % right.)
AGREED = 15
# They agree nearly where so many dots have a patch in one of them only, and none has two; then the
# other's past must be so much likelier (nats). (Tuning half of benchmarks/dots_pictures.py, 15
# dots: of a clip that grabs, seed 1, one account is right until the hand is closed, one from when
# it opens on, and 77 % were right; 98 so, with 100 nats, or with none. Without any, a fist, seed 7,
# is told 99.1 instead of 99.6 % right.)
_NEARLY, _LIKELIER = 2, 40.0


class _Thread(NamedTuple):
    """A way through accounts until a picture, and what is known after it."""

    way: Way
    trace: Trace


def woven(judge: Judge, accounts: Sequence[Account], count: int) -> list[Told]:
    """Dots' patches of `count` pictures; the first account has all of them, and the right start."""
    first = accounts[0][0]
    begun = _Thread(Way(None, first), judge.begin(first))
    threads = {k: begun for k, own in enumerate(accounts) if own.get(0) == first}
    alike = _Alike(accounts)
    for number in range(1, count):
        threads = _extended(judge, accounts, threads, number)
        threads |= _joined(alike, threads, number)
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


class _Alike:
    """For how many pictures in a row each two accounts have agreed, quite and nearly."""

    def __init__(self, accounts: Sequence[Account]) -> None:
        self._accounts = accounts
        count = len(accounts)
        self.quite = np.zeros((count, count), dtype=np.int64)
        self.nearly = np.zeros((count, count), dtype=np.int64)
        self.note(0)

    def note(self, number: int) -> None:
        """Compare them in the next picture, from the first on."""
        told = [own.get(number) for own in self._accounts]
        for j, one in enumerate(told):
            for k, other in enumerate(told[: j + 1]):
                apart = _apart(one, other)
                for runs, most in ((self.quite, 0), (self.nearly, _NEARLY)):
                    runs[j, k] = runs[k, j] = runs[j, k] + 1 if apart <= most else 0


def _apart(one: Told | None, other: Told | None) -> int:
    """In how many dots two accounts of a picture differ; more than nearly, if in patches of a dot.

    None: of an account that ends before, of which nothing is alike, not even it itself.
    """
    if one is None or other is None:
        return _NEARLY + 1
    differ = [(a, b) for a, b in zip(one, other, strict=True) if a != b]
    return len(differ) if all(-1 in pair for pair in differ) else _NEARLY + 1


def _joined(alike: _Alike, threads: Mapping[int, _Thread], number: int) -> dict[int, _Thread]:
    """For each account that goes on, the likeliest thread of those that agree with it."""
    alike.note(number)
    least, found = min(AGREED, number + 1), {}
    for k in np.flatnonzero(np.diag(alike.quite)).tolist():
        there = [thread for j, thread in threads.items() if alike.quite[j, k] >= least or j == k]
        own = _likeliest(there).trace.nats + _LIKELIER if there else -np.inf
        there += [
            thread
            for j, thread in threads.items()
            if alike.nearly[j, k] >= least and thread.trace.nats > own
        ]
        if there:
            found[k] = _likeliest(there)
    return found


def _likeliest(threads: Sequence[_Thread]) -> _Thread:
    return max(threads, key=lambda one: one.trace.nats)
