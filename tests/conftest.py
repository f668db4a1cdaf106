"""Fixtures every room may use: a loopback router, its endpoint, the folder of real recordings."""

from __future__ import annotations

import os

# Before numpy is there. Threads of BLAS wait by spinning: on cores that others share, a fit takes
# four times the processor's time (a registration 17 s, with one thread 4 s).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import asyncio
import contextlib
import resource
import signal
import subprocess
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, AbstractContextManager
from pathlib import Path

import pytest
import zenoh

from rhot.bus.bus import Bus, open_bus, router_config
from rhot.files.config import RigConfig
from rhot.process.lifecycle import Serve
from rhot.process.service import Service
from testing.loopback import free_endpoint

# A shell's background job ignores Ctrl-C, and so would every process that tests start and end.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

REPOSITORY = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def _own_signals() -> Iterator[None]:
    """uvloop leaves its handlers when a command ends: that hides a second Ctrl-C while its process
    ends, and would hide the first from every later test in this one.
    """
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        if signal.getsignal(number) is not handler:
            signal.signal(number, handler)


@pytest.fixture(scope="session")
def repository() -> Path:
    """The source tree."""
    return REPOSITORY


@pytest.fixture(scope="session")
def rhot_data() -> Path:
    """Real recordings: $RHOT_DATA, or ../shared/data beside the source tree."""
    folder = Path(os.environ.get("RHOT_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder}; set RHOT_DATA to their folder")
    return folder


@pytest.fixture
def endpoint() -> str:
    """A loopback endpoint nobody listens at."""
    return free_endpoint()


@pytest.fixture
def router(endpoint: str) -> Iterator[str]:
    """A real Zenoh router; its endpoint."""
    session = zenoh.open(router_config([endpoint]))
    yield endpoint
    session.close()


Running = Callable[..., AbstractAsyncContextManager[tuple[Service, Bus]]]


@pytest.fixture
def running(router: str) -> Running:
    """`async with running(name, serve, config) as (service, bus)`: a service in this process on a
    real router, and a bus of one's own.
    """

    @contextlib.asynccontextmanager
    async def run(
        name: str,
        serve: Serve,
        config: RigConfig,
        *,
        instance: str = "main",
        deadline_s: float = 60.0,
    ) -> AsyncIterator[tuple[Service, Bus]]:
        async with (
            open_bus("desk", [router]) as theirs,
            open_bus("desk", [router]) as ours,
            asyncio.timeout(deadline_s),
            asyncio.TaskGroup() as tasks,
        ):
            service = Service(name, instance, config, theirs, tasks)
            tasks.create_task(serve(service))
            yield service, ours
            # What a service leaves in its tasks ends with its process, and here with this.
            for task in list(tasks._tasks):
                task.cancel()

    return run


@pytest.fixture
def sending() -> Callable[[Callable[[], None]], AbstractContextManager[None]]:
    """`with sending(send):` calls send again and again: subscriptions need a moment to reach the
    router.
    """

    @contextlib.contextmanager
    def repeat(send: Callable[[], None]) -> Iterator[None]:
        async def forever() -> None:
            while True:
                send()
                await asyncio.sleep(0.02)

        task = asyncio.create_task(forever())
        try:
            yield
        finally:
            task.cancel()

    return repeat


@pytest.fixture
def small_files() -> Iterator[None]:
    """No file may grow beyond 300 kB: the system refuses writes, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A real file system of 160 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=160m", "tmpfs", str(folder)],
        capture_output=True,
        check=False,
    )
    if mounted.returncode:
        pytest.skip("mounting a file system needs root")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)
