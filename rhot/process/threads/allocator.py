"""The C library's heap, for processes that run for weeks.

glibc gives each thread a heap of its own. Pictures and messages are then freed by other threads
than those that asked for them, and every heap keeps its gaps: a tracker grew by 15 MB/h in
benchmarks/soak.py. One heap for all threads costs it no processor time that could be measured:
Python's lock is what they share anyway. (A fixed M_MMAP_THRESHOLD ends the growth as well, and
costs it 15 % more processor time, in page faults.)

A recorder is behind at times, and what then waits leaves gaps that are never filled. Its large
blocks are those of the network and of chunks; apart from the heap they cost 9 % more of its
processor time, which is a hundredth of a core. Three recorders of one rig at six times its pace,
beside other work, kept 24.9 MB of what they had needed for a moment, 27.4 with blocks apart from
64 kB on, and 3.1 from 16 kB on.
"""

from __future__ import annotations

import ctypes

# Of glibc's malloc.h.
_M_ARENA_MAX, _M_MMAP_THRESHOLD, _M_TRIM_THRESHOLD = -8, -3, -1
_LARGE_BYTES, _TRIM_BYTES = 16_384, 131_072


def share_one_heap() -> bool:
    """One heap for all threads that are still to come; False where the C library is not glibc."""
    return _set(_M_ARENA_MAX, 1)


def keep_large_blocks_apart() -> bool:
    """Blocks of 16 kB and more are no part of the heap, and the system's again once they are freed.

    False where the C library is not glibc.
    """
    return _set(_M_MMAP_THRESHOLD, _LARGE_BYTES) and _set(_M_TRIM_THRESHOLD, _TRIM_BYTES)


def _set(option: int, value: int) -> bool:
    try:
        libc = ctypes.CDLL(None)
        # musl and macOS have mallopt or malloc, but not this.
        libc.gnu_get_libc_version  # noqa: B018 - raises AttributeError where it is missing
        return bool(libc.mallopt(option, value))
    except (AttributeError, OSError, TypeError):
        # TypeError: Windows has no handle of the program itself.
        return False
