"""Every service survives what anybody may publish or answer: nested, cut off, absurd, not JSON."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import msgspec
import pytest

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import UNDECODABLE, CalibrationError, CaptureError, ConfigError
from rhot.files.calibration import load_colors, load_geometry, load_lens, save
from rhot.files.capture import read_lines
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import ObjectTable, Viewer
from rhot.files.rig_tables import Recorder as RecorderTable
from rhot.messages import Session
from rhot.process.service import Service
from rhot.topics import Kind
from testing.synthetic_points import SyntheticRig

RIG = "bench"
SERVICES = ("recorder", "object_tracker", "viewer", "fusion", "solver", "pi_tracker")
# numba's first compilation on a loaded machine takes most of it.
START_S, SURVIVE_S = 240.0, 30.0
NESTED = {
    "a page of brackets": b"[" * 5_000,
    "the most a message may have": b"[" * 65_000,
    "100k deep": b"[" * 100_000,
    "100k deep and closed": b"[" * 100_000 + b"]" * 100_000,
    "100k objects": b'{"a":' * 100_000,
    "in a field nobody knows": b'{"x":' + b"[" * 30_000 + b"]" * 30_000 + b"}",
}
HOSTILE = {
    **NESTED,
    "nothing": b"",
    "no UTF-8": b'{"v":"\xff\xfe"}',
    "no JSON": b"\x00\x01\x02",
    "cut off": b'{"camera":"left","seq":1,',
    "no object": b"[]",
    "null": b"null",
    "no number": b'{"stamp_ns":NaN}',
    "no float": b'{"stamp_ns":1e999}',
    "a long number": b'{"stamp_ns":' + b"9" * 20_000 + b"}",
    "a key without end": b'{"' + b"a" * 60_000 + b'":1}',
}


@pytest.fixture
def config(tmp_path: Path) -> RigConfig:
    """A rig with everything, calibrated."""
    setup = SyntheticRig()
    setup.save_calibration(tmp_path / "calibration")
    plain = setup.config()
    return msgspec.structs.replace(
        plain,
        folder=str(tmp_path),
        camera=[msgspec.structs.replace(c, source="simulator") for c in plain.camera],
        object=[ObjectTable(name="cup", serial="LHR-1")],
        recorder=RecorderTable(autostart=True),
        viewer=Viewer(port=0),
    )


def keys() -> Iterator[str]:
    """A key of every topic, with names of this rig where it asks for them."""
    names = {"camera": "left", "hand": "right", "object": "cup", "serial": "LHR-1", "host": "h"}
    for topic in topics.TOPICS:
        for service in SERVICES if "service" in topic.fields else ("",):
            given = names | {"service": service, "instance": "main"}
            yield topic.key(RIG, **{field: given[field] for field in topic.fields})


async def live(name: str, config: RigConfig, bus: Bus) -> None:
    """One service as it runs, with its heartbeat."""
    instance = "left" if name == "pi_tracker" else "main"
    async with asyncio.TaskGroup() as tasks:
        service = Service(name, instance, config, bus, tasks)
        tasks.create_task(service.beat())
        tasks.create_task(service.listen())
        await importlib.import_module(f"services.{name}.service").serve(service)


class Rogue:
    """Answers every question with something hostile, one after the other."""

    def __init__(self, bus: Bus) -> None:
        self.asked = 0
        for topic in topics.TOPICS:
            if topic.kind in (Kind.QUERY, Kind.STATE):
                names = {"camera": "left"} if "camera" in topic.fields else {}
                bus.answer(topic, self._answer, **names)

    def _answer(self) -> bytes:
        self.asked += 1
        return list(HOSTILE.values())[self.asked % len(HOSTILE)]


@contextlib.asynccontextmanager
async def all_services(
    router: str, config: RigConfig
) -> AsyncIterator[tuple[Bus, dict[str, asyncio.Task[None]], dict[str, int]]]:
    """A stranger's bus, the services' tasks, and how many beats each has sent."""
    beats: dict[str, int] = {}
    async with contextlib.AsyncExitStack() as stack:
        stranger = await stack.enter_async_context(open_bus(RIG, [router]))
        Rogue(stranger)
        tasks = {}
        for name in SERVICES:
            bus = await stack.enter_async_context(open_bus(RIG, [router]))
            tasks[name] = asyncio.create_task(live(name, config, bus))

        async def listen() -> None:
            async for health in stranger.every(topics.HEALTH, 256):
                if health.state != "starting":
                    beats[health.service] = beats.get(health.service, 0) + 1

        listening = asyncio.create_task(listen())
        yield stranger, tasks, beats
        for task in (*tasks.values(), listening):
            task.cancel()
        await asyncio.gather(*tasks.values(), listening, return_exceptions=True)


async def beaten(
    tasks: dict[str, asyncio.Task[None]], beats: dict[str, int], times: int, seconds: float
) -> None:
    """Each service sends so many more beats, and none has ended."""
    wanted = {name: beats.get(name, 0) + times for name in SERVICES}
    async with asyncio.timeout(seconds):
        while any(beats.get(name, 0) < count for name, count in wanted.items()):
            for name, task in tasks.items():
                assert not task.done(), f"{name} ended: {task.exception()!r}"
            await asyncio.sleep(0.05)


@pytest.mark.integration
async def test_every_service_survives_every_payload_on_every_key(router, config):
    async with all_services(router, config) as (stranger, tasks, beats):
        await beaten(tasks, beats, 1, START_S)
        for key in keys():
            for payload in HOSTILE.values():
                stranger.put_raw(key, payload)
            await asyncio.sleep(0.02)
        stranger.publisher(topics.SESSION).put(Session(running=True, start_ns=1))
        # Two seconds are enough for every service to ask what it asks again and again.
        await beaten(tasks, beats, 3, SURVIVE_S)


@pytest.mark.parametrize("payload", NESTED.values(), ids=NESTED)
@pytest.mark.parametrize("topic", [t for t in topics.TOPICS if t.message], ids=lambda t: t.name)
def test_what_is_nested_raises_what_is_caught(topic, payload):
    with pytest.raises(UNDECODABLE):
        msgspec.json.decode(payload, type=topic.message)


@pytest.mark.parametrize("payload", HOSTILE.values(), ids=HOSTILE)
@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("left.colors.json", lambda folder: load_colors(folder, "left")),
        ("left.lens.json", lambda folder: load_lens(folder, "left")),
        ("rig.json", load_geometry),
    ],
)
def test_a_calibration_that_is_nested_is_one_line(tmp_path, name, load, payload):
    (tmp_path / name).write_bytes(payload)
    with pytest.raises(CalibrationError, match=name):
        load(tmp_path)


@pytest.mark.parametrize("payload", NESTED.values(), ids=NESTED)
def test_a_capture_or_rig_that_is_nested_is_one_line(tmp_path, payload):
    lines = tmp_path / "markers.jsonl"
    lines.write_bytes(payload + b"\n")
    with pytest.raises(CaptureError, match="line 1"):
        list(read_lines(lines, Session))
    rig = tmp_path / "rig.toml"
    rig.write_bytes(b"a = " + payload)
    with pytest.raises(ConfigError, match="not valid TOML"):
        load_rig(rig)


def test_a_calibration_that_does_not_fit_on_the_disk_leaves_the_old_one(tmp_path, small_files):
    save(tmp_path / "a.json", Session(running=True, start_ns=1))
    big = msgspec.defstruct("Big", [("text", str)])("x" * 1_000_000)
    with pytest.raises(CaptureError, match=r"a\.json: cannot be written"):
        save(tmp_path / "a.json", big)
    assert b"start_ns" in (tmp_path / "a.json").read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]
