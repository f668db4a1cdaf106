"""When a rig does what every rig of its process does once in a while: at an instant of its own.

What all of them do at once keeps the messages of all waiting: 32 beats of health, and what else
fusion does once a second, are 20 ms of it. So each has its own share of a period, by its name.
Pure: time is an argument.
"""

from __future__ import annotations

import zlib


def until_turn_s(rig: str, period_s: float, now_s: float) -> float:
    """How long a rig waits, at now_s of a monotonic clock, to do again what is due every period_s.

    Half a period to one and a half the first time, or where it is late; then a period. Counted from
    the last time instead, rigs that were held up together would stay together.
    """
    wait_s = (zlib.crc32(rig.encode()) / 2**32 * period_s - now_s) % period_s
    return wait_s if wait_s >= 0.5 * period_s else wait_s + period_s
