"""`rhot demo` as a user runs it."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.integration

RHOT = str(Path(sys.executable).parent / "rhot")
DEADLINE_S = 180.0


def children_of(pid: int) -> list[int]:
    """All living descendants of a process."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except (FileNotFoundError, ProcessLookupError):
                continue
            if int(fields[1]) == pid and fields[0] != "Z":
                found += [int(entry.name), *children_of(int(entry.name))]
    return found


async def demo(*options: str) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        RHOT,
        "demo",
        *options,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        stdin=asyncio.subprocess.DEVNULL,
    )


def none_left(pids: list[int]) -> bool:
    return not any(Path(f"/proc/{pid}").exists() for pid in pids)


async def test_ends_by_itself_with_a_summary():
    process = await demo("--seconds", "4", "--json")
    pids: set[int] = set()
    async with asyncio.timeout(DEADLINE_S):
        output_task = asyncio.create_task(process.communicate())
        while not output_task.done():
            pids |= set(children_of(process.pid))
            await asyncio.sleep(0.2)
    output, said = await output_task
    assert process.returncode == 0, said.decode()
    summary = json.loads(output)
    assert summary["poses"] > 30
    assert summary["tip_error_rms_mm"] is not None
    assert summary["object_poses"] > 30
    assert summary["restarts"] == {}
    assert b"live view: http://127.0.0.1:" in said
    assert len(pids) >= 8
    assert none_left(list(pids))


async def test_ctrl_c_ends_everything():
    process = await demo("--no-viewer")
    async with asyncio.timeout(DEADLINE_S):
        while len(children_of(process.pid)) < 7:
            await asyncio.sleep(0.1)
        pids = children_of(process.pid)
        process.send_signal(signal.SIGINT)
        await process.communicate()
    assert none_left(pids)


async def test_a_kill_takes_the_children_along():
    process = await demo("--no-viewer")
    async with asyncio.timeout(DEADLINE_S):
        while len(children_of(process.pid)) < 7:
            await asyncio.sleep(0.1)
        pids = children_of(process.pid)
        os.kill(process.pid, signal.SIGKILL)
        await process.communicate()
        while not none_left(pids):
            await asyncio.sleep(0.1)


async def test_without_poses_it_says_so_and_fails(tmp_path, repository):
    text = (
        (repository / "config" / "sim.toml")
        .read_text()
        .replace('index_tip = "blue"', 'index_tip = "plaid"')
    )
    (tmp_path / "rig.toml").write_text(text)
    (tmp_path / "calibration").symlink_to(repository / "config" / "calibration")
    process = await demo("--no-viewer", "--seconds", "1", "--config", str(tmp_path / "rig.toml"))
    said = b""
    async with asyncio.timeout(DEADLINE_S):
        while b"plaid" not in said:
            said += await process.stderr.readline()
        process.send_signal(signal.SIGINT)
        await process.communicate()
    assert process.returncode == 1
