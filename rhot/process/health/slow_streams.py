"""Which of a service's streams are below their expected rate, for long enough to say so. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from rhot.messages.health import StreamHealth

# One slow second is scheduling, three are a fault; and three good ones its end, so that a stream at
# the limit does not come and go each second.
_BEATS = 3


class SlowStreams:
    """The streams that have been slow for three beats, until they are well for three."""

    def __init__(self) -> None:
        self._slow: Counter[tuple[str, str]] = Counter()
        self._well: Counter[tuple[str, str]] = Counter()
        self._named: set[tuple[str, str]] = set()

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
            self._slow[name] = 0 if stream.ok else self._slow[name] + 1
            self._well[name] = self._well[name] + 1 if stream.ok else 0
            if self._slow[name] >= _BEATS:
                self._named.add(name)
            elif self._well[name] >= _BEATS:
                self._named.discard(name)
        for gone in (self._slow.keys() | self._well.keys()) - present.keys():
            del self._slow[gone], self._well[gone]
            self._named.discard(gone)
        return {
            f"{direction} {key}": _text(present[direction, key])
            for direction, key in sorted(self._named)
        }


def _text(stream: StreamHealth) -> str:
    kept = "received" if stream.direction == "in" else "sent"
    text = f"{stream.key}: {stream.rate_hz:.1f} Hz {kept} of {stream.expected_hz:.1f} expected"
    lost = [
        f"{count} {what}"
        for count, what in ((stream.dropped, "dropped"), (stream.rejected, "rejected"))
        if count
    ]
    return ", ".join([text, *lost])
