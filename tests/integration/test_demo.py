"""`rhot demo` as a user runs it."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

import rhot
from rhot.errors import BusError
from rhot.messages.camera import Colors

pytestmark = pytest.mark.integration

RHOT = str(Path(sys.executable).parent / "rhot")
DEADLINE_S = 180.0
# linux/prctl.h, linux/capability.h
PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1


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


async def demo(*options: str, **process) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        RHOT,
        "demo",
        *options,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        stdin=asyncio.subprocess.DEVNULL,
        **process,
    )


async def children_running(process: asyncio.subprocess.Process, count: int) -> list[int]:
    """The children's pids, once there are so many."""
    while len(children_of(process.pid)) < count:
        await asyncio.sleep(0.1)
    return children_of(process.pid)


def none_left(pids: list[int]) -> bool:
    return not any(Path(f"/proc/{pid}").exists() for pid in pids)


def content(folder: Path) -> dict[str, bytes]:
    """Every file below a folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.timeout(600)
async def test_from_an_empty_folder_it_ends_by_itself_with_a_summary(tmp_path, repository):
    shipped = content(repository / "config")
    (tmp_path / "empty").mkdir()
    (tmp_path / "tmp").mkdir()
    environment = {**os.environ, "TMPDIR": str(tmp_path / "tmp")}
    pids: set[int] = set()
    # A machine that is busy with something else stands still for seconds: it is given more.
    for seconds in ("4", "20", "60"):
        options = ("--seconds", seconds, "--json")
        process = await demo(*options, cwd=tmp_path / "empty", env=environment)
        async with asyncio.timeout(DEADLINE_S):
            output_task = asyncio.create_task(process.communicate())
            while not output_task.done():
                pids |= set(children_of(process.pid))
                await asyncio.sleep(0.2)
        output, said = await output_task
        assert process.returncode == 0, said.decode()
        summary = json.loads(output)
        assert summary["restarts"] == {}
        if min(summary["poses"], summary["object_poses"]) > 30:
            break
    assert min(summary["poses"], summary["object_poses"]) > 30
    assert summary["tip_error_rms_mm"] is not None
    assert b"live view: http://127.0.0.1:" in said
    assert len(pids) >= 8
    assert none_left(list(pids))
    assert content(repository / "config") == shipped
    assert not list((tmp_path / "empty").iterdir())
    assert not list((tmp_path / "tmp").glob("rhot-demo-*"))


def bound_by_permissions() -> None:
    """Give up the right of root to write where no permission is; nothing to give up for others."""
    ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)


@pytest.fixture
def installed(tmp_path, repository):
    """rhot as a wheel installs it, its configuration read-only: (folder to import from, config).

    Only the command is copied; the services are the source tree's, whose kernels are compiled.
    """
    cli = tmp_path / "site" / "services" / "cli"
    shutil.copytree(repository / "services" / "cli", cli)
    services = str(repository / "services")
    (cli.parent / "__init__.py").write_text(f"__path__.append({services!r})\n")
    config = cli / "config"
    shutil.copytree(repository / "config", config)
    for path in (*config.rglob("*"), config):
        path.chmod(0o555 if path.is_dir() else 0o444)
    touch = ["touch", str(config / "new")]
    refused = subprocess.run(
        touch, check=False, capture_output=True, preexec_fn=bound_by_permissions
    )
    assert refused.returncode != 0
    yield tmp_path / "site", config
    for path in (config, config / "calibration"):
        path.chmod(0o755)


async def colors_of(rig: rhot.RigClient, camera: str) -> Colors:
    """The camera's colours, once its tracker answers."""
    while True:
        with contextlib.suppress(BusError):
            return await rig.colors(camera)
        await asyncio.sleep(0.2)


async def test_what_a_user_sets_goes_to_the_working_folder_and_never_to_the_package(
    tmp_path, repository, installed
):
    site, config = installed
    shipped = content(config)
    kept = tmp_path / "kept"
    process = await demo(
        "--no-viewer",
        "--folder",
        str(kept),
        env={**os.environ, "PYTHONPATH": f"{site}{os.pathsep}{repository}"},
        cwd=tmp_path,
        preexec_fn=bound_by_permissions,
    )
    async with asyncio.timeout(DEADLINE_S):
        said = b""
        while not (router := re.search(rb"router at (\S+);", said)):
            said += await process.stderr.readline()
        async with rhot.connect(router[1].decode(), "sim") as rig:
            colors = await colors_of(rig, "left")
            wanted = msgspec.structs.replace(colors, date="2020-02-02", tool="test")
            await rig.set_colors("left", wanted)
            await anext(rig.hand_poses("right"))
        process.send_signal(signal.SIGINT)
        _, rest = await process.communicate()
    assert process.returncode == 0, (said + rest).decode()
    saved = msgspec.json.decode((kept / "calibration" / "left.colors.json").read_bytes())
    assert (saved["date"], saved["tool"]) == ("2020-02-02", "test")
    assert content(config) == shipped
    assert content(repository / "config") == shipped


async def test_ctrl_c_ends_everything():
    process = await demo("--no-viewer")
    async with asyncio.timeout(DEADLINE_S):
        pids = await children_running(process, 6)
        process.send_signal(signal.SIGINT)
        await process.communicate()
    assert none_left(pids)


async def test_a_kill_takes_the_children_along(tmp_path):
    # Nobody is left to remove the temporary folder.
    process = await demo("--no-viewer", env={**os.environ, "TMPDIR": str(tmp_path)})
    async with asyncio.timeout(DEADLINE_S):
        pids = await children_running(process, 6)
        os.kill(process.pid, signal.SIGKILL)
        await process.communicate()
        while not none_left(pids):
            await asyncio.sleep(0.1)


async def test_without_poses_it_says_so_and_fails(tmp_path, repository):
    text = (repository / "config" / "sim.toml").read_text()
    text = text.replace('index_tip = "blue"', 'index_tip = "plaid"')
    (tmp_path / "rig.toml").write_text(text)
    shutil.copytree(repository / "config" / "calibration", tmp_path / "calibration")
    process = await demo("--no-viewer", "--seconds", "1", "--config", str(tmp_path / "rig.toml"))
    said = b""
    async with asyncio.timeout(DEADLINE_S):
        while b"plaid" not in said:
            said += await process.stderr.readline()
        process.send_signal(signal.SIGINT)
        await process.communicate()
    assert process.returncode == 1
