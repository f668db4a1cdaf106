"""The simulator's newest truths, to compare with what comes later. Pure."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from rhot.messages.simulator import Truth

# Truth kept: two seconds at 90 Hz, far longer than any pose takes.
KEPT = 180


class Between(NamedTuple):
    """The truths around an instant; share 0..1 is how far it is from the one to the other."""

    before: Truth
    after: Truth
    share: float


class Truths:
    """Truths as they arrive, in order of their stamps."""

    def __init__(self) -> None:
        self._truths: deque[Truth] = deque(maxlen=KEPT)

    def add(self, truth: Truth) -> None:
        """Take one in; the oldest goes."""
        self._truths.append(truth)

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest, 0 before the first."""
        return self._truths[-1].stamp_ns if self._truths else 0

    def around(self, stamp_ns: int) -> Between | None:
        """The truths before and after an instant; None outside of what is kept."""
        truths = self._truths
        # What is asked for is nearly always new: from the end it is found in a few steps.
        for last in range(len(truths) - 1, 0, -1):
            before, after = truths[last - 1], truths[last]
            if before.stamp_ns <= stamp_ns <= after.stamp_ns:
                span_ns = max(1, after.stamp_ns - before.stamp_ns)
                return Between(before, after, (stamp_ns - before.stamp_ns) / span_ns)
        return None
