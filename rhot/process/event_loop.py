"""The event loop of a process, the signals that end it, on Linux and on Windows, and how it ends
processes that it has started.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import signal
from collections.abc import Callable, Coroutine, Iterator
from typing import Any

_PR_SET_PDEATHSIG = 1  # of Linux's prctl.h


def run_loop(main: Coroutine[Any, Any, None]) -> None:
    """asyncio.run() on uvloop; without uvloop, which there is none of for Windows, on asyncio's."""
    run: Callable[[Coroutine[Any, Any, None]], None] = asyncio.run
    with contextlib.suppress(ModuleNotFoundError):
        import uvloop

        run = uvloop.run
    run(main)


def stop_on_signals() -> asyncio.Event:
    """SIGTERM and SIGINT cancel the current task, on Windows Ctrl-Break, too; the event tells that
    they did.
    """
    stopping = asyncio.Event()
    task = asyncio.current_task()
    loop = asyncio.get_running_loop()

    def stop() -> None:
        stopping.set()
        if task is not None:
            task.cancel()

    for name in ("SIGTERM", "SIGINT", "SIGBREAK"):
        number = getattr(signal, name, None)
        if number is None:
            continue
        try:
            loop.add_signal_handler(number, stop)
        except NotImplementedError:  # Windows: Python's own handler, which wakes the loop
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop))
    return stopping


@contextlib.contextmanager
def cancelled_by(stopping: asyncio.Event) -> Iterator[None]:
    """Swallow the cancellation that a signal asked for, and no other."""
    try:
        yield
    except asyncio.CancelledError:
        if not stopping.is_set():
            raise


async def end_process(process: asyncio.subprocess.Process, patience_s: float) -> None:
    """End a process, if it has not ended: SIGTERM, and SIGKILL where that takes too long."""
    if process.returncode is not None:
        return
    with contextlib.suppress(ProcessLookupError):
        process.terminate()
        try:
            await asyncio.wait_for(process.wait(), patience_s)
        except TimeoutError:
            process.kill()
            await process.wait()


def ending_with_parent() -> Callable[[], None]:
    """For preexec_fn: Linux kills the new process when this one is gone, however it ended.

    At once: one that is stuck hears nothing else.
    """
    prctl = ctypes.CDLL(None).prctl

    def ask() -> None:
        prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)

    return ask
