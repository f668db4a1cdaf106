from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path

import pytest

from services.cli.live.supervisor import Child, Supervisor

DEADLINE_S = 20.0


@pytest.fixture
def heard():
    return []


@pytest.fixture
def supervisor(heard):
    return Supervisor(lambda name, level, text: heard.append((name, level, text)))


async def until(condition):
    async with asyncio.timeout(DEADLINE_S):
        while not condition():
            await asyncio.sleep(0.02)


def child(script):
    return Child("probe", [sys.executable, "-c", script])


def is_running(pid):
    return Path(f"/proc/{pid}").exists()


async def test_a_killed_child_is_started_again(supervisor, heard):
    task = asyncio.create_task(
        supervisor.keep(child("import time; print('up', flush=True); time.sleep(60)"))
    )
    await until(lambda: ("probe", "info", "up") in heard)
    first = supervisor.pids["probe"]
    os.kill(first, 9)
    await until(lambda: heard.count(("probe", "info", "up")) == 2)
    assert supervisor.restarts == {"probe": 1}
    assert any("SIGKILL" in text for _, _, text in heard)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    assert not is_running(supervisor.pids["probe"])


async def test_a_child_that_ignores_sigterm_is_killed(supervisor, heard, monkeypatch):
    monkeypatch.setattr("services.cli.live.supervisor._STOP_S", 0.3)
    script = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('deaf', flush=True); time.sleep(60)"
    task = asyncio.create_task(supervisor.keep(child(script)))
    await until(lambda: ("probe", "info", "deaf") in heard)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    assert not is_running(supervisor.pids["probe"])


async def test_children_die_with_the_supervisor(tmp_path):
    script = (
        "import asyncio, sys\n"
        "from services.cli.live.supervisor import Child, Supervisor\n"
        "s = Supervisor(lambda *a: print(s.pids['probe'], flush=True))\n"
        "asyncio.run(s.keep(Child('probe', [sys.executable, '-c', 'import time; print(1, flush=True); time.sleep(60)'])))"
    )
    parent = await asyncio.create_subprocess_exec(
        sys.executable, "-c", script, stdout=asyncio.subprocess.PIPE
    )
    async with asyncio.timeout(DEADLINE_S):
        pid = int(await parent.stdout.readline())
    parent.kill()
    await parent.wait()
    await until(
        lambda: not is_running(pid) or "Z" in Path(f"/proc/{pid}/stat").read_text().split()[2]
    )


async def test_json_log_lines_come_out_as_text(supervisor, heard):
    script = 'print(\'{"level": "warning", "text": "careful", "who": "x"}\', flush=True); print("plain"); import time; time.sleep(60)'
    task = asyncio.create_task(
        supervisor.keep(child("import sys; sys.stdout.reconfigure(line_buffering=True)\n" + script))
    )
    await until(lambda: len(heard) >= 2)
    assert heard[:2] == [("probe", "warning", "careful"), ("probe", "info", "plain")]
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


async def test_a_user_error_is_not_retried_at_once(supervisor, heard):
    task = asyncio.create_task(supervisor.keep(child("raise SystemExit(2)")))
    await until(lambda: heard)
    assert "starting again in 5 s" in heard[-1][2]
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
