"""A service's life, in a real process with a real router and a real notify socket."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
import textwrap

import pytest

from rhot import topics
from rhot.bus.bus import open_bus

DEADLINE_S = 60.0
ENDINGS = {
    "user": "raise SourceError('the camera is gone; plug it in')",
    "bug": "raise ValueError('oops')",
    "task": "service.tasks.create_task(broken()); await asyncio.Event().wait()",
    "done": "return",
    "wait": "await asyncio.Event().wait()",
    "stuck": "import time; time.sleep(60)",
}


@pytest.fixture
def start(tmp_path, endpoint):
    """Start a service process that ends in the way named; returns (process, notify socket)."""
    (tmp_path / "rig.toml").write_text(
        f'[rig]\nname = "test"\n[bus]\nconnect = ["{endpoint}"]\n[[camera]]\nname = "left"\n'
    )
    server = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    server.bind(str(tmp_path / "notify"))
    server.setblocking(False)

    async def launch(ending: str, **environment: str):
        script = textwrap.dedent(f"""
            import asyncio
            from rhot.errors import SourceError
            from rhot.process.lifecycle import command
            async def broken():
                raise SourceError('a task failed')
            async def serve(service):
                service.values["answer"] = 42.0
                service.ready()
                service.error("a small thing")
                {ENDINGS[ending]}
            command("probe", "__main__", "a service that ends as it is told")
        """)
        own = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "RHOT_LOG_FORMAT": "json"}
        environment = {**os.environ, **own, **environment}
        argv = [sys.executable, "-c", script, "--config", str(tmp_path / "rig.toml")]
        pipes = {"stdout": asyncio.subprocess.PIPE, "stderr": asyncio.subprocess.STDOUT}
        return await asyncio.create_subprocess_exec(*argv, **pipes, env=environment)

    yield launch, server
    server.close()


async def ended(process):
    async with asyncio.timeout(DEADLINE_S):
        output, _ = await process.communicate()
    return process.returncode, [json.loads(line) for line in output.splitlines()]


@pytest.mark.parametrize(
    ("ending", "code", "says"),
    [
        ("user", 2, "plug it in"),
        ("task", 2, "a task failed"),
        ("bug", 1, "failed"),
        ("done", 0, ""),
    ],
)
async def test_the_exit_code_tells_what_ended_it(start, router, ending, code, says):
    launch, _ = start
    returned, lines = await ended(await launch(ending))
    assert returned == code
    assert not says or any(says in line["text"] for line in lines if line["level"] == "error")
    assert all(line["who"] == "probe/main" for line in lines)
    if ending == "bug":
        assert "ValueError: oops" in lines[-1]["trace"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
async def test_signals_end_it_cleanly_and_systemd_hears(start, router, number):
    launch, server = start
    process = await launch("wait", WATCHDOG_USEC="200000")
    heard = ""
    async with asyncio.timeout(DEADLINE_S):
        while "READY=1" not in heard or heard.count("WATCHDOG=1") < 3:
            heard += (await asyncio.get_running_loop().sock_recv(server, 4096)).decode() + "\n"
    process.send_signal(number)
    code, _ = await ended(process)
    assert code == 0
    async with asyncio.timeout(DEADLINE_S):
        while "STOPPING=1" not in heard:
            heard += (await asyncio.get_running_loop().sock_recv(server, 4096)).decode()


async def test_a_stuck_loop_stops_feeding_the_watchdog(start, router):
    launch, server = start
    process = await launch("stuck", WATCHDOG_USEC="200000")
    loop = asyncio.get_running_loop()
    async with asyncio.timeout(DEADLINE_S):
        while "READY=1" not in (await loop.sock_recv(server, 4096)).decode():
            pass
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1.0):
            while True:
                await loop.sock_recv(server, 4096)
    process.kill()
    await process.communicate()


async def test_health_and_liveliness_are_published(start, router):
    launch, _ = start
    async with open_bus("test", [router]) as bus:
        beats, alive = bus.every(topics.HEALTH, 16), bus.watch_alive()
        process = await launch("wait")
        async with asyncio.timeout(DEADLINE_S):
            change, health = await anext(alive), await anext(beats)
        assert (change.service, change.alive) == ("probe", True)
        assert (health.service, health.state, health.errors, health.last_error) == (
            "probe",
            "running",
            1,
            "a small thing",
        )
        assert health.values == {"answer": 42.0}
        assert health.pid == process.pid
        assert 5.0 < health.rss_mb < 500.0
        process.terminate()
        assert (await ended(process))[0] == 0
        async with asyncio.timeout(DEADLINE_S):
            assert not (await anext(alive)).alive


async def test_it_waits_for_the_router_and_can_be_stopped_meanwhile(start):
    launch, _ = start
    process = await launch("wait")
    async with asyncio.timeout(DEADLINE_S):
        line = json.loads(await process.stdout.readline())
    assert "no router at" in line["text"]
    process.terminate()
    assert (await ended(process))[0] == 0


async def test_a_broken_rig_toml_is_one_line_and_code_2(start, tmp_path):
    launch, _ = start
    (tmp_path / "rig.toml").write_text("[rig]\nnam = 'x'")
    code, lines = await ended(await launch("wait"))
    assert code == 2
    assert len(lines) == 1
    assert "did you mean `name`?" in lines[0]["text"]
