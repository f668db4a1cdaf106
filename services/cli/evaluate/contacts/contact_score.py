"""Touches and grasps against the simulator's truth: found, missed, false, and how far off.

A true touch begins where the distance falls to 0.5 mm and ends where it rises above 1 mm, between
two lines of truth by a straight line. A found one is its match if the two overlap, or nearly so;
each has one match at most. Its errors are those of its begin and end: in time, and the true
distance at those instants. What is found without a match is false, but where the part mostly was no
further away than the 3 mm that are allowed: then it is near.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import msgspec
import numpy as np
import numpy.typing as npt

from rhot.contact_events import GraspEvent, GraspEvents, TouchEvent, TouchEvents
from rhot.geometry.transforms import Array
from rhot.messages.objects import ObjectContacts
from rhot.messages.simulator import Truth

# The simulator's fingers stop at the surface to within 0.3 mm; skin gives more.
_BEGIN_M, _END_M = 0.0005, 0.001
# What is meant to be one touch may be found a little before or after it.
_SLACK_NS = 200_000_000
# What is asked of a touch's begin and end: a frame and a half, and what tips are off themselves.
WITHIN_MS, WITHIN_MM = 50.0, 3.0
_MS = 1e-6


class Span(NamedTuple):
    """Something that lasts; end_ns is the last instant known if it lasts on."""

    begin_ns: int
    end_ns: int


class TouchScore(msgspec.Struct, frozen=True, kw_only=True):
    """All touches of one object.

    within_share: of the begins and ends of all true touches, those found within 50 ms and 3 mm;
    begins and ends of missed ones count as not found.
    """

    true: int
    found: int
    missed: int
    false: int
    near: int
    within_share: float
    begin_ms: tuple[float, float]  # median, 95th percentile of the errors' size
    end_ms: tuple[float, float]
    begin_mm: tuple[float, float]
    end_mm: tuple[float, float]


class GraspScore(msgspec.Struct, frozen=True, kw_only=True):
    """All grasps of one object: right is one found for one true, and the errors of those."""

    true: int
    right: int
    missed: int
    false: int
    begin_ms: tuple[float, float]
    end_ms: tuple[float, float]


class ContactScore(msgspec.Struct, frozen=True, kw_only=True):
    """Who touched and who held one object."""

    touches: TouchScore
    grasps: GraspScore


class EdgeErrors(NamedTuple):
    """Errors of the touches found, and what was not; n of them."""

    begin: Array  # (n, 2) ms, mm
    end: Array  # (n, 2)
    missed: int
    false: int
    near: int


def contact_score(
    truth: Sequence[Truth], messages: Iterable[ObjectContacts], name: str
) -> ContactScore | None:
    """The score of one object; None if the truth tells no distances of it."""
    lines = [line for line in truth if name in line.objects]
    known = sorted({key for line in lines for key in line.objects[name].contacts})
    if not known:
        return None
    own = [message for message in messages if message.object == name]
    errors, count = touch_errors(lines, own, name)
    return ContactScore(
        touches=TouchScore(
            true=count,
            found=len(errors.begin),
            missed=errors.missed,
            false=errors.false,
            near=errors.near,
            within_share=within_share(errors, count),
            begin_ms=_typical(errors.begin[:, 0]),
            end_ms=_typical(errors.end[:, 0]),
            begin_mm=_typical(errors.begin[:, 1]),
            end_mm=_typical(errors.end[:, 1]),
        ),
        grasps=_grasp_score(lines, own, name),
    )


def within_share(errors: EdgeErrors, true: int) -> float:
    """Begins and ends within 50 ms and 3 mm, of all true ones; 1 if there are none."""
    edges = np.abs(np.concatenate([errors.begin, errors.end]))
    good = (edges[:, 0] <= WITHIN_MS) & (edges[:, 1] <= WITHIN_MM)
    return float(good.sum()) / (2 * true) if true else 1.0


def touch_errors(
    lines: Sequence[Truth], messages: Sequence[ObjectContacts], name: str
) -> tuple[EdgeErrors, int]:
    """Errors of every begin and end of every part, and the number of true touches."""
    events = TouchEvents()
    found_events = [event for message in messages for event in events.feed(message)]
    last_ns = max((message.stamp_ns for message in messages), default=0)
    begins, ends = [np.empty((0, 2))], [np.empty((0, 2))]
    missed = false = near = count = 0
    for key in sorted({key for line in lines for key in line.objects[name].contacts}):
        stamps, gaps = _series(lines, name, key)
        true = true_touches(stamps, gaps)
        found = _spans((e for e in found_events if f"{e.hand}.{e.part}" == key), last_ns)
        pairs = _matched(true, found)
        count, missed = count + len(true), missed + len(true) - len(pairs)
        matched = {other for _, other in pairs}
        for other in found:
            if other not in matched:
                close = not any(_overlap(one, other) > 0 for one in true)
                close &= _mostly(stamps, gaps, other) * 1e3 <= WITHIN_MM
                near, false = near + close, false + (not close)
        for one, other in pairs:
            for side, errors in ((0, begins), (1, ends)):
                gap = float(np.interp(other[side], stamps, gaps))
                errors.append(np.array([[(other[side] - one[side]) * _MS, gap * 1e3]]))
    return EdgeErrors(np.concatenate(begins), np.concatenate(ends), missed, false, near), count


def true_touches(stamps_ns: npt.NDArray[np.int64], gaps_m: Array) -> list[Span]:
    """When a distance (n,) touches, by the two thresholds."""
    spans, begin = [], None
    for n, gap in enumerate(gaps_m.tolist()):
        if begin is None and gap <= _BEGIN_M:
            begin = _crossing(stamps_ns, gaps_m, n, _BEGIN_M)
        elif begin is not None and gap > _END_M:
            spans.append(Span(begin, _crossing(stamps_ns, gaps_m, n, _END_M)))
            begin = None
    if begin is not None:
        spans.append(Span(begin, int(stamps_ns[-1])))
    return spans


def _crossing(stamps_ns: npt.NDArray[np.int64], gaps_m: Array, n: int, at_m: float) -> int:
    """When the line from instant n - 1 to n crosses at_m; n itself where it is the first."""
    if n == 0:
        return int(stamps_ns[0])
    share = (at_m - gaps_m[n - 1]) / (gaps_m[n] - gaps_m[n - 1])
    return int(stamps_ns[n - 1]) + round(share * int(stamps_ns[n] - stamps_ns[n - 1]))


def _grasp_score(
    lines: Sequence[Truth], messages: Sequence[ObjectContacts], name: str
) -> GraspScore:
    events = GraspEvents()
    found_events = [event for message in messages for event in events.feed(message)]
    last_ns = max((message.stamp_ns for message in messages), default=0)
    errors, count, right, false = [np.empty((0, 2))], 0, 0, 0
    for hand in ("left", "right"):
        true = _held(lines, name, hand)
        found = _spans((e for e in found_events if e.hand == hand), last_ns)
        pairs = _matched(true, found)
        count, right, false = (
            count + len(true),
            right + len(pairs),
            false + len(found) - len(pairs),
        )
        errors += [
            np.array([[(b.begin_ns - a.begin_ns) * _MS, (b.end_ns - a.end_ns) * _MS]])
            for a, b in pairs
        ]
    each = np.concatenate(errors)
    return GraspScore(
        true=count,
        right=right,
        missed=count - right,
        false=false,
        begin_ms=_typical(each[:, 0]),
        end_ms=_typical(each[:, 1]),
    )


def _held(lines: Sequence[Truth], name: str, hand: str) -> list[Span]:
    spans: list[Span] = []
    before = False
    for line in lines:
        now = line.objects[name].held_by == hand
        if now and before:
            spans[-1] = Span(spans[-1].begin_ns, line.stamp_ns)
        elif now:
            spans.append(Span(line.stamp_ns, line.stamp_ns))
        before = now
    return spans


def _series(lines: Sequence[Truth], name: str, key: str) -> tuple[npt.NDArray[np.int64], Array]:
    known = [
        (line.stamp_ns, line.objects[name].contacts[key])
        for line in lines
        if key in line.objects[name].contacts
    ]
    stamps, gaps = zip(*known, strict=True)
    return np.array(stamps, dtype=np.int64), np.array(gaps)


def _spans(events: Iterable[TouchEvent | GraspEvent], last_ns: int) -> list[Span]:
    """Begins and ends of one part, in order, as spans; what lasts on ends with the messages."""
    spans: list[Span] = []
    open_ns: int | None = None
    for event in events:
        if event.kind == "begin":
            open_ns = event.stamp_ns
        elif open_ns is not None:
            spans.append(Span(open_ns, event.stamp_ns))
            open_ns = None
    if open_ns is not None:
        spans.append(Span(open_ns, max(last_ns, open_ns)))
    return spans


def _matched(true: Sequence[Span], found: Sequence[Span]) -> list[tuple[Span, Span]]:
    """Pairs that overlap, the longest overlap first, each in one pair at most."""
    overlaps = sorted(
        ((_overlap(a, b), i, j) for i, a in enumerate(true) for j, b in enumerate(found)),
        reverse=True,
    )
    taken_true: set[int] = set()
    taken_found: set[int] = set()
    pairs = []
    for overlap, i, j in overlaps:
        if overlap > -_SLACK_NS and i not in taken_true and j not in taken_found:
            taken_true.add(i)
            taken_found.add(j)
            pairs.append((true[i], found[j]))
    return pairs


def _overlap(a: Span, b: Span) -> int:
    """Nanoseconds that two spans share; negative: how far apart they are."""
    return min(a.end_ns, b.end_ns) - max(a.begin_ns, b.begin_ns)


def _mostly(stamps_ns: npt.NDArray[np.int64], gaps_m: Array, span: Span) -> float:
    """The median of the true distance during a span."""
    times = np.linspace(span.begin_ns, span.end_ns, 50)
    return float(np.median(np.interp(times, stamps_ns, gaps_m)))


def _typical(errors: Array) -> tuple[float, float]:
    """Median and 95th percentile of the size, 0 where there is none."""
    if not len(errors):
        return 0.0, 0.0
    median, tail = np.percentile(np.abs(errors), [50.0, 95.0])
    return round(float(median), 3), round(float(tail), 3)
