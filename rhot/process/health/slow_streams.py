"""Which of a service's streams are below their expected rate, for long enough to say so. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from rhot.messages.health import StreamHealth

# One slow second is scheduling, three are a fault; and three good ones its end, so that a stream at
# the limit does not come and go each second.
_BEATS = 3
# A stream that has not begun is late after so many beats, not slow before: who sends it may still
# start. A demo's cameras come up to 10 s after its fusion where two cores start all of it.
_FIRST_BEATS = 20


class SlowStreams:
    """The streams that have been slow for three beats, until they are well for three.

    Beats count from the one after a stream's first message; one that never has any is slow after
    twenty.
    """

    def __init__(self) -> None:
        self._slow: Counter[tuple[str, str]] = Counter()
        self._well: Counter[tuple[str, str]] = Counter()
        self._named: set[tuple[str, str]] = set()
        self._begun: set[tuple[str, str]] = set()
        self._waited: Counter[tuple[str, str]] = Counter()

    @property
    def any_slow(self) -> bool:
        """Whether a stream is slow, or was so at the last beat."""
        return bool(self._named or +self._slow)

    def beat(self, streams: Iterable[StreamHealth]) -> dict[str, str]:
        """What is wrong after one more second, by stream; one that is no longer there is well."""
        present: dict[tuple[str, str], StreamHealth] = {
            (stream.direction, stream.key): stream for stream in streams
        }
        for name, stream in present.items():
            ok = self._begins(name, stream) or stream.ok
            self._slow[name] = 0 if ok else self._slow[name] + 1
            self._well[name] = self._well[name] + 1 if ok else 0
            if self._slow[name] >= _BEATS:
                self._named.add(name)
            elif self._well[name] >= _BEATS:
                self._named.discard(name)
        for gone in (self._slow.keys() | self._well.keys()) - present.keys():
            del self._slow[gone], self._well[gone], self._waited[gone]
            self._named.discard(gone)
            self._begun.discard(gone)
        return {
            f"{direction} {key}": _text(present[direction, key])
            for direction, key in sorted(self._named)
        }

    def _begins(self, name: tuple[str, str], stream: StreamHealth) -> bool:
        """Whether a stream has only just begun in this beat, or may be expected still to begin."""
        if name in self._begun:
            return False
        if stream.count:
            self._begun.add(name)
        elif stream.expected_hz > 0.0:
            self._waited[name] += 1
        return self._waited[name] <= _FIRST_BEATS - _BEATS


def _text(stream: StreamHealth) -> str:
    kept = "received" if stream.direction == "in" else "sent"
    rates = f"{stream.rate_hz:.1f} a second {kept} instead of {stream.expected_hz:.1f}"
    text = f"{stream.key}: {rates}"
    lost = [
        f"{count} {what}"
        for count, what in ((stream.dropped, "dropped"), (stream.rejected, "rejected"))
        if count
    ]
    return ", ".join([text, *lost])
