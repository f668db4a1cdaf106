"""New calibration files end a service with the code that asks for a new start."""

from __future__ import annotations

import asyncio
import json
import os
import sys
import textwrap

import msgspec
import pytest_asyncio

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.files.calibration import save
from rhot.messages.camera import Exposure
from rhot.process.lifecycle import EXIT_AGAIN

DEADLINE_S = 60.0
SCRIPT = textwrap.dedent("""
    import asyncio
    from rhot.files.calibration import load_exposure
    from rhot.process.calibration_watch import load_and_watch
    from rhot.process.lifecycle import command
    async def serve(service):
        folder = service.config.calibration_dir
        def load():
            return load_exposure(folder, "left")
        files = [folder / "left.exposure.json", folder / "not-there.json"]
        service.values["gain"] = load_and_watch(service, files, load).gain
        service.ready()
        await asyncio.Event().wait()
    command("probe", "__main__", "a service with one calibration file")
""")


def exposure(gain: float) -> Exposure:
    return Exposure(exposure_us=8000.0, gain=gain, red_gain=1.0, blue_gain=1.0)


@pytest_asyncio.fixture
async def probe(tmp_path, router):
    """(process, its calibration file) of a service that has loaded the file."""
    (tmp_path / "rig.toml").write_text(f'[rig]\nname = "test"\n[bus]\nconnect = ["{router}"]\n')
    path = tmp_path / "calibration" / "left.exposure.json"
    save(path, exposure(2.0))
    argv = [sys.executable, "-c", SCRIPT, "--config", str(tmp_path / "rig.toml")]
    process = await asyncio.create_subprocess_exec(
        *argv, stdout=asyncio.subprocess.PIPE, env={**os.environ, "RHOT_LOG_FORMAT": "json"}
    )
    async with asyncio.timeout(DEADLINE_S):
        while "ready" not in json.loads(await process.stdout.readline())["text"]:
            pass
    yield process, path
    if process.returncode is None:
        process.kill()
        await process.wait()


async def ended(process):
    async with asyncio.timeout(DEADLINE_S):
        output, _ = await process.communicate()
    return process.returncode, [json.loads(line)["text"] for line in output.splitlines()]


async def test_a_new_file_ends_it_to_be_started_again(probe):
    process, path = probe
    save(path, exposure(3.0))
    code, lines = await ended(process)
    assert code == EXIT_AGAIN
    assert "left.exposure.json changed: starting again with it" in lines


async def test_a_file_that_was_not_there_counts_and_an_old_time_too(probe):
    process, path = probe
    other = path.with_name("not-there.json")
    other.write_text("{}")
    os.utime(other, (0, 0))
    code, lines = await ended(process)
    assert code == EXIT_AGAIN
    assert any("not-there.json" in line for line in lines)


async def test_a_broken_file_is_told_and_the_old_one_stays_until_it_is_mended(probe, router):
    process, path = probe
    good = path.read_bytes()
    async with open_bus("test", [router]) as bus:
        beats = bus.latest(topics.HEALTH)
        path.write_bytes(b"{")
        async with asyncio.timeout(DEADLINE_S):
            while not (faults := (await anext(beats)).faults):
                pass
        assert [fault.code for fault in faults] == ["not_calibrated"]
        assert "left.exposure.json" in faults[0].text
        assert process.returncode is None
        path.write_bytes(msgspec.json.encode(msgspec.json.decode(good)))
    code, _ = await ended(process)
    assert code == EXIT_AGAIN
