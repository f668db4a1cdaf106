"""Children are restarted, ended and read by the supervisor."""

from __future__ import annotations

import asyncio
import os
import sys
import textwrap
from pathlib import Path

import pytest

from services.cli.live.supervisor import Child, Supervisor
from testing.waiting import until

DEADLINE_S = 60.0


@pytest.fixture
def lines():
    return []


@pytest.fixture
def supervisor(lines):
    return Supervisor(lambda name, level, text: lines.append((name, level, text)))


def child(script):
    return Child("probe", [sys.executable, "-c", script])


def is_running(pid):
    return Path(f"/proc/{pid}").exists()


async def test_a_killed_child_is_started_again(supervisor, lines):
    task = asyncio.create_task(
        supervisor.keep_running(child("import time; print('up', flush=True); time.sleep(60)"))
    )
    await until(lambda: ("probe", "info", "up") in lines)
    first = supervisor.pids["probe"]
    os.kill(first, 9)
    await until(lambda: lines.count(("probe", "info", "up")) == 2)
    assert supervisor.restarts == {"probe": 1}
    assert any("SIGKILL" in text for _, _, text in lines)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    assert not is_running(supervisor.pids["probe"])


async def test_a_child_that_ignores_sigterm_is_killed(supervisor, lines, monkeypatch):
    monkeypatch.setattr("services.cli.live.supervisor._STOP_S", 0.3)
    script = (
        "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN);"
        "print('deaf', flush=True); time.sleep(60)"
    )
    task = asyncio.create_task(supervisor.keep_running(child(script)))
    await until(lambda: ("probe", "info", "deaf") in lines)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    assert not is_running(supervisor.pids["probe"])


async def test_children_die_with_the_supervisor(tmp_path):
    script = textwrap.dedent("""
        import asyncio, sys
        from services.cli.live.supervisor import Child, Supervisor
        supervisor = Supervisor(lambda *line: print(supervisor.pids["probe"], flush=True))
        sleep = "import time; print(1, flush=True); time.sleep(60)"
        asyncio.run(supervisor.keep_running(Child("probe", [sys.executable, "-c", sleep])))
    """)
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


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('{"level": "warning", "text": "careful", "who": "x"}', ("warning", "careful")),
        ("plain", ("info", "plain")),
        ("rhot-viewer: error: needs viser", ("error", "needs viser")),
    ],
)
async def test_every_line_comes_out_with_its_level(supervisor, lines, line, expected):
    script = f"print({line!r}, flush=True); import time; time.sleep(60)"
    task = asyncio.create_task(supervisor.keep_running(child(script)))
    await until(lambda: lines)
    assert lines == [("probe", *expected)]
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


async def test_a_user_error_is_not_retried_at_once(supervisor, lines):
    task = asyncio.create_task(supervisor.keep_running(child("raise SystemExit(2)")))
    await until(lambda: lines)
    assert "starting again in 5 s" in lines[-1][2]
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
