"""Runs libsurvive from its shared library, as survive-cli does: that is a main() around five of its
functions, but the PyPI package pysurvive is without it.

    python -m services.object_tracker.sources.survive_library LIBSURVIVE.so [survive-cli's options]

A process of its own, since libsurvive may crash, and prints to standard output by itself.
"""

from __future__ import annotations

import ctypes
import signal
import sys


def run(library: str, arguments: list[str]) -> int:
    """Runs libsurvive until it ends, or a signal asks; it keeps its calibration. An exit code."""
    survive = ctypes.CDLL(library, mode=ctypes.RTLD_GLOBAL)
    context, text = ctypes.c_void_p, ctypes.c_char_p
    survive.survive_init_internal.argtypes = [
        ctypes.c_int,
        ctypes.POINTER(text),
        ctypes.c_void_p,
        ctypes.c_void_p,
    ]
    survive.survive_init_internal.restype = context
    for name in ("survive_startup", "survive_poll", "survive_close"):
        getattr(survive, name).argtypes = [context]
    words = [b"survive-cli", *(word.encode() for word in arguments)]
    # libsurvive keeps pointers into it: it lives as long as this function.
    argv = (text * (len(words) + 1))(*words, None)
    stop: list[int] = []
    for one in (signal.SIGTERM, signal.SIGINT):
        signal.signal(one, lambda number, _frame: stop.append(number))
    survivor = survive.survive_init_internal(len(words), argv, None, None)
    if not survivor:
        return 1
    failed = survive.survive_startup(survivor)
    while not failed and not stop and survive.survive_poll(survivor) == 0:
        pass
    survive.survive_close(survivor)
    return int(failed != 0)


if __name__ == "__main__":
    sys.exit(run(sys.argv[1], sys.argv[2:]))
