"""All threads of a process have one heap, and large blocks none, once that is asked for."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

# How many heaps there are after eight threads have had memory at the same time.
HEAPS = """
import ctypes, sys, threading
from rhot.process.threads.allocator import share_one_heap
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

# By how many bytes the heap grows for a hundred blocks of 64 kB.
GROWTH = """
import ctypes, sys
from rhot.process.threads.allocator import keep_large_blocks_apart
if "apart" in sys.argv:
    assert keep_large_blocks_apart()
libc = ctypes.CDLL(None)
libc.malloc.restype = libc.sbrk.restype = ctypes.c_void_p
before = libc.sbrk(0)
for _ in range(100):
    libc.malloc(ctypes.c_size_t(65_536))
print(libc.sbrk(0) - before)
"""
glibc_only = pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc", reason="this C library is not glibc"
)


def output(script: str, *words: str) -> str:
    command = [sys.executable, "-c", script, *words]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def heaps(*words: str) -> int:
    return output(HEAPS, *words).count("<heap nr=")


@glibc_only
def test_threads_share_one_heap() -> None:
    assert heaps("shared") == 1
    assert heaps() > 1


@glibc_only
def test_large_blocks_are_no_part_of_the_heap() -> None:
    assert int(output(GROWTH, "apart")) < 1_000_000
    assert int(output(GROWTH)) > 5_000_000
