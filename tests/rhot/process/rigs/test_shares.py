"""A service with more rigs than fit a process, as real processes on a real router."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import socket
import sys
import textwrap
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from rhot.process.rigs.shares import in_shares
from testing.waiting import DEADLINE_S, until

SERVICE = textwrap.dedent("""
    import asyncio, os
    from rhot.process.lifecycle import command
    async def serve(service):
        service.ready()
        while True:
            await asyncio.sleep(0.05)
            if (service.config.calibration_dir / "crash").exists():
                (service.config.calibration_dir / "crash").unlink()
                os.kill(os.getpid(), 9)
            if (service.config.calibration_dir / "stick").exists():
                while True:
                    pass
    command("probe", "__main__", "a service of many rigs", several_rigs=True, rigs_a_process=1)
""")
several_processors = pytest.mark.skipif(
    (os.cpu_count() or 1) < 2, reason="with one processor all rigs are served by one process"
)


def test_shares_are_as_equal_as_can_be_and_no_more_than_processors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    files = [Path(f"{n}.toml") for n in range(33)]
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert in_shares(files, 1) == [files]
    assert [len(one) for one in in_shares(files, 3)] == [11, 11, 11]
    assert [len(one) for one in in_shares(files, 16)] == [9, 8, 8, 8]
    assert in_shares(files[:2], 16) == [files[:1], files[1:2]]
    assert sorted(file for share in in_shares(files, 4) for file in share) == sorted(files)


@pytest.fixture
async def notified(tmp_path: Path) -> AsyncIterator[list[str]]:
    """What systemd has heard."""
    heard: list[str] = []
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind(str(tmp_path / "notify"))
        server.setblocking(False)
        loop = asyncio.get_running_loop()
        # At once, as systemd does: who tells it something waits until there is room.
        loop.add_reader(server, lambda: heard.extend(server.recv(4096).decode().splitlines()))
        yield heard
        loop.remove_reader(server)


@pytest.fixture
async def process(
    tmp_path: Path, endpoint: str, router: object, notified: object
) -> AsyncIterator[asyncio.subprocess.Process]:
    """Three rigs in two processes: a and c in one, b in the other."""
    (tmp_path / "rigs").mkdir()
    for name in ("a", "b", "c"):
        (tmp_path / "rigs" / name).mkdir()
        (tmp_path / "rigs" / f"{name}.toml").write_text(
            f'[rig]\nname = "{name}"\ncalibration = "{name}"\n'
            f'[bus]\nconnect = ["{endpoint}"]\n[[camera]]\nname = "left"\nfps = 40\n'
        )
    environment = {
        **os.environ,
        "NOTIFY_SOCKET": str(tmp_path / "notify"),
        "WATCHDOG_USEC": "400000",
        "RHOT_LOG_FORMAT": "json",
    }
    argv = [sys.executable, "-c", SERVICE, "--config", str(tmp_path / "rigs")]
    with (tmp_path / "out").open("wb") as out:
        found = await asyncio.create_subprocess_exec(*argv, stdout=out, stderr=out, env=environment)
    yield found
    if found.returncode is None:
        found.kill()
        await found.wait()


def said(tmp_path: Path) -> list[dict[str, str]]:
    return [json.loads(line) for line in (tmp_path / "out").read_text().splitlines()]


def ready(tmp_path: Path) -> list[str]:
    return [line["rig"] for line in said(tmp_path) if line["text"].endswith("ready")]


def alive(pids: list[int]) -> list[int]:
    return [pid for pid in pids if Path(f"/proc/{pid}").exists()]


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


@several_processors
async def test_each_share_has_a_process_and_one_that_dies_starts_again_alone(
    process: asyncio.subprocess.Process, tmp_path: Path, notified: list[str]
) -> None:
    def status() -> str:
        return [line for line in notified if line.startswith("STATUS=")][-1]

    await until(lambda: sorted(ready(tmp_path)) == ["a", "b", "c"])
    before = children(process.pid)
    assert len(before) == 2
    assert "READY=1" in notified
    (tmp_path / "rigs" / "a" / "crash").touch()
    await until(lambda: sorted(ready(tmp_path)) == ["a", "a", "b", "c", "c"])
    after = children(process.pid)
    assert len(set(before) & set(after)) == 1
    (died,) = [line["text"] for line in said(tmp_path) if "starts again" in line["text"]]
    assert "the process of a, c ended with signal SIGKILL" in died
    await until(lambda: sorted(re.findall(r"\b([abc]): running", status())) == ["a", "b", "c"])
    process.send_signal(signal.SIGTERM)
    async with asyncio.timeout(DEADLINE_S):
        assert await process.wait() == 0
    assert not alive(after)
    await until(lambda: "STOPPING=1" in notified)


@several_processors
async def test_a_stuck_process_is_not_covered_up_by_one_that_turns(
    process: asyncio.subprocess.Process, tmp_path: Path, notified: list[str]
) -> None:
    await until(lambda: sorted(ready(tmp_path)) == ["a", "b", "c"])
    await until(lambda: "WATCHDOG=1" in notified)
    (tmp_path / "rigs" / "b" / "stick").touch()
    # Its last word may be on the way; systemd acts upon a silence like this one's.
    async with asyncio.timeout(DEADLINE_S):
        while "WATCHDOG=1" in notified:
            notified.clear()
            await asyncio.sleep(1.0)
    # Nor does it stay behind when the service is killed.
    shares = children(process.pid)
    process.kill()
    await process.wait()
    await until(lambda: not alive(shares))


@several_processors
async def test_no_share_outlives_a_service_that_was_killed(
    process: asyncio.subprocess.Process, tmp_path: Path
) -> None:
    await until(lambda: sorted(ready(tmp_path)) == ["a", "b", "c"])
    shares = children(process.pid)
    process.kill()
    await process.wait()
    await until(lambda: not alive(shares))


async def test_all_rigs_are_served_together_where_that_is_asked_for(
    tmp_path: Path, endpoint: str, router: object, process: asyncio.subprocess.Process
) -> None:
    process.kill()
    await process.wait()
    (tmp_path / "out").write_text("")
    argv = [sys.executable, "-c", SERVICE, "--config", str(tmp_path / "rigs"), "--one-process"]
    with (tmp_path / "out").open("ab") as out:
        together = await asyncio.create_subprocess_exec(
            *argv, stdout=out, stderr=out, env={**os.environ, "RHOT_LOG_FORMAT": "json"}
        )
    await until(lambda: sorted(ready(tmp_path)) == ["a", "b", "c"])
    assert not children(together.pid)
    together.terminate()
    async with asyncio.timeout(DEADLINE_S):
        assert await together.wait() == 0


@several_processors
async def test_a_share_that_cannot_begin_ends_the_service_with_its_reason(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        (tmp_path / f"{name}.toml").write_text(
            f'[rig]\nname = "{name}"\n[[camera]]\nname = "left"\nfps = 40\n'
        )
    # As where the extra is not installed.
    (tmp_path / "probe_part.py").write_text(
        "raise ModuleNotFoundError(\"No module named 'numba'\", name='numba')\n"
    )
    process = await asyncio.create_subprocess_exec(
        *[sys.executable, "-c", SERVICE.replace("__main__", "probe_part")],
        *["--config", str(tmp_path)],
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}"},
    )
    async with asyncio.timeout(DEADLINE_S):
        output, _ = await process.communicate()
    text = output.decode()
    assert process.returncode == 2, text
    assert "pip install" in text
    assert "cannot begin; it says why" in text


async def test_two_files_of_one_rig_are_told_although_there_are_shares(
    tmp_path: Path, endpoint: str, router: object
) -> None:
    (tmp_path / "rigs").mkdir()
    for name in ("a", "b"):
        (tmp_path / "rigs" / f"{name}.toml").write_text(
            f'[rig]\nname = "same"\n[bus]\nconnect = ["{endpoint}"]\n'
            '[[camera]]\nname = "left"\nfps = 90\n'
        )
    argv = [sys.executable, "-c", SERVICE, "--config", str(tmp_path / "rigs")]
    with (tmp_path / "out").open("wb") as out:
        process = await asyncio.create_subprocess_exec(
            *argv, stdout=out, stderr=out, env={**os.environ, "RHOT_LOG_FORMAT": "json"}
        )
    await until(lambda: len(said(tmp_path)) >= 2)
    process.terminate()
    async with asyncio.timeout(DEADLINE_S):
        await process.wait()
    texts = " ".join(line["text"] for line in said(tmp_path))
    assert "every rig of a network has a [rig] name of its own" in texts
    assert ready(tmp_path) == ["same"]
