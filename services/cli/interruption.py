"""A command that is interrupted, by Ctrl-C or SIGTERM, ends as one that fails does: it tidies up,
and says so in one line.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType

from rhot.plain_text import printable


class _TerminatedError(KeyboardInterrupt):
    """SIGTERM, which would end Python at once, without any tidying up."""


@contextlib.contextmanager
def interruptible(command: str, left: object) -> Iterator[None]:
    """The work of a command, which writes to the folder `left`.

    Ends with the shell's codes for a signal: 130 after Ctrl-C, 143 after SIGTERM.
    """

    def terminate(_number: int, _frame: FrameType | None) -> None:
        raise _TerminatedError

    # Signals are the main thread's; a program that calls this from another has its own ways.
    handles = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, terminate) if handles else None
    try:
        yield
    except KeyboardInterrupt as interrupt:
        text = f"{command}: interrupted; nothing unfinished is left in {left}; run it again"
        print(printable(text), file=sys.stderr)
        terminated = isinstance(interrupt, _TerminatedError)
        raise SystemExit(143 if terminated else 130) from None
    finally:
        if handles:
            signal.signal(signal.SIGTERM, before)
