"""All threads of a process have one heap, once that is asked for."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

# How many heaps there are after eight threads have had memory at the same time.
HEAPS = """
import ctypes, sys, threading
from rhot.process.allocator import share_one_heap
if "shared" in sys.argv:
    assert share_one_heap()
libc = ctypes.CDLL(None)
libc.malloc.restype = libc.fopen.restype = ctypes.c_void_p
together = threading.Barrier(8)
def use():
    together.wait()
    libc.malloc(ctypes.c_size_t(100_000))
    together.wait()
threads = [threading.Thread(target=use) for _ in range(8)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
file = ctypes.c_void_p(libc.fopen(b"/dev/stdout", b"w"))
libc.malloc_info(0, file)
libc.fflush(file)
"""


def heaps(*words: str) -> int:
    done = subprocess.run(
        [sys.executable, "-c", HEAPS, *words], capture_output=True, text=True, check=True
    )
    return done.stdout.count("<heap nr=")


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="this C library is not glibc")
def test_threads_share_one_heap() -> None:
    assert heaps("shared") == 1
    assert heaps() > 1
