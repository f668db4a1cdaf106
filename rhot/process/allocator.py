"""The C library's heap, for processes that run for weeks.

glibc gives each thread a heap of its own. Pictures and messages are then freed by other threads
than those that asked for them, and every heap keeps its gaps: a tracker grew by 15 MB/h in
benchmarks/soak.py. One heap for all threads costs it no processor time that could be measured:
Python's lock is what they share anyway. (A fixed M_MMAP_THRESHOLD ends the growth as well, and
costs it 15 % more processor time, in page faults.)
"""

from __future__ import annotations

import ctypes

# M_ARENA_MAX of glibc's malloc.h.
_M_ARENA_MAX = -8


def share_one_heap() -> bool:
    """One heap for all threads that are still to come; False where the C library is not glibc."""
    try:
        libc = ctypes.CDLL(None)
        # musl and macOS have mallopt or malloc, but not this.
        libc.gnu_get_libc_version  # noqa: B018 - raises AttributeError where it is missing
        return bool(libc.mallopt(_M_ARENA_MAX, 1))
    except (AttributeError, OSError, TypeError):
        # TypeError: Windows has no handle of the program itself.
        return False
