"""The order of one serial's messages: which continue its stream, which are old, repeated, of
another time, or of a second sender.

Pure. A stamp must be later than the last one, and seq must rise with it. Where the arrival is
known, a stamp further than 5 s from where the stream's stamps lie against it is of another time:
recordings are replayed with their own stamps, so that only the distance to the stream itself can
tell. A clock that was set is followed once messages with rising seq have come alone for 2 s. What a
second sender says is left out while the first one goes on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["next", "repeated", "out_of_order", "future", "past", "second_sender"]

# Late Wi-Fi packets were seen after 1 s; nothing that is 5 s late is of use to anybody.
_FAR_NS = 5_000_000_000
# Messages of another time that follow each other alone for so long, and at least so many, are of a
# clock that was set.
_SET_NS, _SET_COUNT = 2_000_000_000, 10
# A stream that was silent for so long may go on from any seq: its sender was started again, which
# takes longer. Sources send at 90 Hz and more.
_SILENT_NS = 300_000_000
# Numbers that a sender may skip: 64 devices at 1 kHz may share one count, and lost messages are no
# other sender.
_SKIP, _SKIP_PER_NS = 256, 64e-6
# A message overtaken by so few others is the same sender's.
_OVERTAKEN = 16
# A device's stream is gone after so long.
_GONE_NS = 5_000_000_000
# So often a stranger's message between the first one's, within this time: two senders.
_TWICE_COUNT, _TWICE_NS = 3, 5_000_000_000


@dataclass
class _Other:
    """Messages that do not continue the stream, but each other."""

    began_ns: int  # on the clock of the arrivals, or of the stamps where there are none
    stamp_ns: int
    seq: int
    count: int = 1


class MessageOrder:
    """Judges the messages of one serial; arrivals are None where files are read."""

    def __init__(self) -> None:
        self._last_ns = -1
        self._last_seq = 0
        self._arrived_ns = 0
        self._lag_ns = 0  # arrival minus stamp of the last message that counted
        self._counts = False  # whether this sender's seq was seen rising
        self._stride = 1  # its first rise: some count in larger steps than by one
        self._other: _Other | None = None
        self._fresh = False  # whether the stream went on since the last stranger
        self._strangers = 0
        self._stranger_ns = 0

    def judge(self, seq: int, stamp_ns: int, arrival_ns: int | None = None) -> Verdict:
        """Whether a message is the stream's next, or what else it is."""
        now_ns = stamp_ns if arrival_ns is None else arrival_ns
        if self._last_ns < 0:
            return self._take(seq, stamp_ns, now_ns)
        verdict = self._of_time(stamp_ns, now_ns)
        if verdict == "next":
            if self._continues(seq, stamp_ns, now_ns):
                if not self._counts and seq > self._last_seq:
                    self._counts, self._stride = True, seq - self._last_seq
                return self._take(seq, stamp_ns, now_ns)
            verdict = "second_sender"
        elif verdict == "repeated" or 0 <= self._last_seq - seq <= _OVERTAKEN:
            return verdict
        if self._follows_other(seq, stamp_ns, now_ns):
            return self._take(seq, stamp_ns, now_ns)
        self._note_stranger(now_ns)
        return verdict

    def twice(self, now_ns: int) -> bool:
        """Whether two senders used this serial within the last 5 s, by the arrivals' clock."""
        return self._strangers >= _TWICE_COUNT and now_ns - self._stranger_ns < _TWICE_NS

    def _take(self, seq: int, stamp_ns: int, now_ns: int) -> Verdict:
        self._last_ns, self._last_seq = stamp_ns, seq
        self._arrived_ns, self._lag_ns = now_ns, now_ns - stamp_ns
        self._fresh = True
        self._other = None
        return "next"

    def _of_time(self, stamp_ns: int, now_ns: int) -> Verdict:
        if stamp_ns <= self._last_ns:
            return "repeated" if stamp_ns == self._last_ns else "out_of_order"
        later_ns = now_ns - stamp_ns - self._lag_ns
        if later_ns < -_FAR_NS:
            return "future"
        return "past" if later_ns > _FAR_NS else "next"

    def _continues(self, seq: int, stamp_ns: int, now_ns: int) -> bool:
        """Whether seq follows, or the stream was silent long enough to begin anew."""
        silent_ns = max(0, min(stamp_ns - self._last_ns, now_ns - self._arrived_ns))
        if silent_ns > _SILENT_NS:
            self._counts, self._stride = False, 1
            return True
        ahead = seq - self._last_seq
        if not self._counts:
            return ahead >= 0
        return 1 <= ahead <= _SKIP * self._stride + _SKIP_PER_NS * silent_ns

    def _follows_other(self, seq: int, stamp_ns: int, now_ns: int) -> bool:
        """Whether the messages that are not the stream's are what it is from now on."""
        other = self._other
        if other is None or seq <= other.seq or stamp_ns <= other.stamp_ns:
            self._other = _Other(now_ns, stamp_ns, seq)
        else:
            other.seq, other.stamp_ns, other.count = seq, stamp_ns, other.count + 1
            alone = other.count >= _SET_COUNT and now_ns - other.began_ns >= _SET_NS
            # The count goes on: the same sender, whose clock was set. What is sent again has a
            # count that was there already.
            if alone and seq > self._last_seq:
                return True
        live = abs(now_ns - stamp_ns) <= _FAR_NS or abs(self._lag_ns) > _FAR_NS
        return live and now_ns - self._arrived_ns > _GONE_NS

    def _note_stranger(self, now_ns: int) -> None:
        if not 0 <= now_ns - self._stranger_ns < _TWICE_NS:
            self._strangers = 0
        # Two senders alternate.
        self._strangers += self._fresh
        self._stranger_ns, self._fresh = now_ns, False
