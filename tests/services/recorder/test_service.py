"""The running recorder on a real router, and replay back onto the bus."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import CaptureError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Recorder as RecorderTable
from rhot.messages import Session
from services.recorder.reader import Record, read
from services.recorder.service import serve
from services.recorder.sources.playback import check_names
from services.recorder.sources.replay import replay
from services.recorder.writer import RecordingWriter
from testing.waiting import until

Write = Callable[..., Path]


async def test_everything_marked_is_recorded_garbage_too(running: Callable, tmp_path: Path) -> None:
    config = RigConfig(folder=str(tmp_path), recorder=RecorderTable(autostart=True))
    keys = {
        "rhot/desk/camera/left/markers": b"\xff\x00",
        "rhot/desk/hand/right/pose": b"[1]",
        "rhot-picture/desk/camera/left/preview": b"jpeg",
    }
    async with running("recorder", serve, config) as (service, bus):

        def publish() -> None:
            for key, payload in keys.items():
                bus.put_raw(key, payload)

        await until(lambda: service.values.get("messages", 0) >= 4, publish)
        assert service.state == "running"
    (path,) = (tmp_path / "recordings").glob("rhot-desk-*.mcap")
    records = list(read(path))
    assert {(r.key, r.payload) for r in records} == {
        item for item in keys.items() if "preview" not in item[0]
    }
    assert abs(records[-1].log_time_ns - records[0].log_time_ns) < 20 * 10**9


async def test_sessions_by_broadcast_and_after_a_restart(running: Callable, tmp_path: Path) -> None:
    config = RigConfig(folder=str(tmp_path))
    folder = tmp_path / "recordings"
    async with running("recorder", serve, config) as (service, bus):
        publisher = bus.publisher(topics.SESSION)
        await until(
            lambda: list(folder.glob("*.mcap")),
            lambda: publisher.put(Session(running=True, start_ns=10**18)),
        )
        await until(lambda: service.values.get("recording") == 1.0)
        bus.answer(topics.SESSION, lambda: Session(running=True, start_ns=10**18))
        async with running("recorder", serve, config):
            await until(lambda: len(list(folder.glob("*.mcap"))) == 2)
    assert [p.name for p in sorted(folder.iterdir())] == [
        "rhot-desk-20010909-014640-2.mcap",
        "rhot-desk-20010909-014640.mcap",
    ]


async def test_cut_files_are_restored_at_the_start(
    running: Callable, tmp_path: Path, write: Write
) -> None:
    path = write(tmp_path / "recordings" / "rhot-desk-1.mcap")
    path.write_bytes(path.read_bytes()[:-5])
    (tmp_path / "recordings" / "rhot-desk-2.mcap").write_bytes(b"")
    async with running("recorder", serve, RigConfig(folder=str(tmp_path))) as (service, _):
        await until(lambda: service.state == "running")
        assert service.errors == 2
    assert len(list(read(tmp_path / "recordings" / "rhot-desk-1.recovered.mcap"))) == 1000


async def test_a_folder_that_cannot_be_written_ends_the_service(
    running: Callable, tmp_path: Path
) -> None:
    (tmp_path / "recordings").write_text("")
    with pytest.RaisesGroup(CaptureError):
        async with running(
            "recorder",
            serve,
            RigConfig(folder=str(tmp_path), recorder=RecorderTable(autostart=True)),
        ):
            await asyncio.Event().wait()


@contextlib.asynccontextmanager
async def heard(
    router: str, rig: str
) -> AsyncIterator[tuple[Bus, asyncio.Queue[tuple[str, bytes]]]]:
    """A bus to replay to, and what another session hears of it."""
    async with (
        open_bus(rig, [router]) as ours,
        open_bus(rig, [router]) as theirs,
        asyncio.timeout(60.0),
    ):
        queue: asyncio.Queue[tuple[str, bytes]] = asyncio.Queue()

        async def listen() -> None:
            async for sample in theirs.raw(topics.MARKERS, 4096):
                await queue.put((sample.key, sample.payload))

        task = asyncio.create_task(listen())
        try:
            # The subscription needs a moment to reach the router.
            await until(
                lambda: not queue.empty(),
                lambda: ours.put_raw(topics.MARKERS.key(rig, camera="ping"), b""),
            )
            while not queue.empty():
                queue.get_nowait()
            yield ours, queue
        finally:
            task.cancel()


async def take(queue: asyncio.Queue[tuple[str, bytes]], count: int) -> list[tuple[str, bytes]]:
    found: list[tuple[str, bytes]] = []
    while len(found) < count:
        key, payload = await queue.get()
        if "ping" not in key:
            found.append((key, payload))
    return found


async def test_replay_flat_out_rewrites_the_rig_and_loses_nothing(
    router: str, tmp_path: Path, write: Write, payload: Callable[[int], bytes]
) -> None:
    path = write(tmp_path / "a.mcap", 2000, rig="elsewhere")
    async with heard(router, "lab") as (bus, queue):
        assert await replay(bus, path, 0.0) == 2000
        found = await take(queue, 2000)
    assert [data for _, data in found] == [payload(seq) for seq in range(2000)]
    assert {key for key, _ in found} == {
        "rhot/lab/camera/left/markers",
        "rhot/lab/camera/right/markers",
    }


async def test_replay_keeps_time(router: str, tmp_path: Path, write: Write) -> None:
    path = write(tmp_path / "a.mcap", 31)
    loop = asyncio.get_running_loop()
    async with heard(router, "desk") as (bus, _):
        for rate, expected_s in ((1.0, 0.3), (3.0, 0.1)):
            start_s = loop.time()
            await replay(bus, path, rate)
            assert expected_s <= loop.time() - start_s < expected_s + 0.2


async def test_replay_in_a_loop_and_only_some(router: str, tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        writer.add(topics.MARKERS, "rhot/desk/camera/left/markers", b"m", 1)
        writer.add(topics.POSE, "rhot/desk/hand/left/pose", b"p", 2)
        # Recorded, as somebody published it; never to be published again.
        writer.add(topics.MARKERS, "rhot/desk/camera/*/markers", b"wild", 3)
        writer.add(topics.MARKERS, "rhot/desk/camera/left/other", b"unknown", 3)
    async with heard(router, "desk") as (bus, queue):
        records: list[Record] = []
        task = asyncio.create_task(
            replay(
                bus,
                tmp_path / "a.mcap",
                0.0,
                loop=True,
                only=["camera/markers"],
                report=records.append,
            )
        )
        assert await take(queue, 5) == [("rhot/desk/camera/left/markers", b"m")] * 5
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        assert {r.payload for r in records} == {b"m"}
        with pytest.raises(CaptureError, match="nothing to replay in a loop"):
            await replay(bus, tmp_path / "a.mcap", 0.0, loop=True, only=["hand/points"])


async def test_replay_refuses(router: str, tmp_path: Path, write: Write) -> None:
    path = write(tmp_path / "a.mcap", 10)
    async with open_bus("desk", [router]) as bus:
        for rate in (-1.0, float("nan"), float("inf")):
            with pytest.raises(CaptureError, match="1 is real time"):
                await replay(bus, path, rate)
        (tmp_path / "b.mcap").write_text("no recording")
        with pytest.raises(CaptureError, match="no MCAP file"):
            await replay(bus, tmp_path / "b.mcap")
    with pytest.raises(CaptureError, match="'camera/preview'; valid: camera/markers"):
        check_names(["camera/preview"])
