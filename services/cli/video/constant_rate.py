"""Pictures at a constant rate from pictures at any: the nearest one in time. Pure.

Phones record at a variable rate, and the videos that OpenCV writes have a constant one. A picture
is shown at most half an interval early or late; nothing is blended.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar

import numpy as np

from rhot.errors import CaptureError

T = TypeVar("T")

# What screens show; a slow-motion video of 240 Hz would be written four times as long for nothing.
_MAX_HZ = 60.0
# Times more pictures shown than there are: a camera that paused shows its last picture, but stamps
# that are hours apart are damaged, and the video would never end.
_MAX_REPEATED = 20


def rate_hz(camera: str, stamps_ns: Sequence[int]) -> float:
    """The rate of a camera's video: its usual one, 60 Hz at most.

    Raises CaptureError for stamps that no recording has.
    """
    steps_ns = np.diff(np.asarray(stamps_ns, dtype=np.int64))
    if not len(steps_ns):
        return 1.0
    usual_hz = round(min(1e9 / max(float(np.median(steps_ns)), 1.0), _MAX_HZ), 3)
    shown = 1e-9 * float(steps_ns.sum()) * usual_hz
    if shown > _MAX_REPEATED * (len(steps_ns) + 1):
        raise CaptureError(
            f"camera {camera!r}: {len(steps_ns) + 1} pictures lie {1e-9 * steps_ns.sum():.0f} s "
            "apart by their times, which are damaged; track it with its rate by hand "
            "(`rhot track --fps`)"
        )
    return usual_hz


def at_rate(pictures: Iterable[tuple[int, T]], hz: float) -> Iterator[T]:
    """For each instant of a constant rate, from the first picture on, the one that is nearest.

    pictures: (stamp in ns, picture) in the order of time; two are held at a time.
    """
    remaining = iter(pictures)
    first = next(remaining, None)
    if first is None:
        return
    start_ns, shown = first[0], 0
    stamp_ns, picture = first
    for next_ns, following in remaining:
        while start_ns + shown * 1e9 / hz < 0.5 * (stamp_ns + next_ns):
            yield picture
            shown += 1
        stamp_ns, picture = next_ns, following
    while start_ns + shown * 1e9 / hz < stamp_ns + 0.5e9 / hz:
        yield picture
        shown += 1
