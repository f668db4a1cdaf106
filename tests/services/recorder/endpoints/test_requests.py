"""What the recorder is asked for on the bus: record, stop, list, replay."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import RefusedError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, RigTable
from rhot.messages import Session
from rhot.messages.recording import RecorderRequest, RecorderState, Replay, replay_rig
from services.recorder.reader import read
from services.recorder.service import serve_on_request

Write = Callable[..., Path]
KEY = "rhot/desk/camera/left/markers"


class Asked:
    """A recorder in this process, and who asks it."""

    def __init__(self, bus: Bus, folder: Path) -> None:
        self.bus, self.folder = bus, folder

    async def ask(self, do: str, **values: object) -> RecorderState:
        request = RecorderRequest(do=do, **values)  # type: ignore[arg-type]
        return await self.bus.request(topics.RECORDER, request)

    async def state(self) -> RecorderState:
        (state,) = await self.bus.get(topics.RECORDER)
        return state

    async def replay(self) -> Replay:
        replay = (await self.state()).replay
        assert replay is not None
        return replay


@pytest.fixture
async def recorder(running: Callable, tmp_path: Path) -> AsyncIterator[Asked]:
    config = RigConfig(folder=str(tmp_path), camera=[CameraTable(name="left")])
    async with running("recorder", serve_on_request, config) as (service, bus):
        while service.state != "running":
            await asyncio.sleep(0.01)
        yield Asked(bus, tmp_path / "recordings")


async def test_it_records_from_the_request_to_the_next(recorder: Asked) -> None:
    bus = recorder.bus
    session = bus.publisher(topics.SESSION)
    for _ in range(3):
        session.put(Session(running=True, start_ns=10**18))
        bus.put_raw(KEY, b"before")
        await asyncio.sleep(0.02)
    assert (await recorder.state()).file == ""
    with pytest.raises(RefusedError, match="nothing is being recorded"):
        await recorder.ask("stop")
    state = await recorder.ask("record")
    assert state.file.startswith("rhot-desk-")
    with pytest.raises(RefusedError, match="is being recorded already"):
        await recorder.ask("record")
    while (await recorder.state()).messages < 5:
        bus.put_raw(KEY, b"wanted")
        await asyncio.sleep(0.02)
    (listed,) = (await bus.get(topics.RECORDINGS))[0].recordings
    assert (listed.name, listed.state) == (state.file, "recording")
    assert (await recorder.ask("stop")).file == ""
    kept = [r.payload for r in read(recorder.folder / state.file) if r.key == KEY]
    assert set(kept) == {b"wanted"}
    # And again, into another file.
    assert (await recorder.ask("record")).file != state.file
    await recorder.ask("stop")
    listed = (await bus.get(topics.RECORDINGS))[0].recordings
    assert [one.state for one in listed] == ["whole", "whole"]
    assert {one.rig for one in listed} == {"desk"}


async def test_a_recording_is_replayed_beside_the_live_rig(
    recorder: Asked, router: str, write: Write, payload: Callable[[int], bytes]
) -> None:
    write(recorder.folder / "a.mcap", 300)
    heard: list[str] = []
    async with open_bus("*", [router]) as listener:
        samples = listener.raw(topics.MARKERS, 4096)

        async def listen() -> None:
            async for sample in samples:
                heard.append(sample.key)  # noqa: PERF401 - it never ends

        task = asyncio.create_task(listen())
        state = await recorder.ask("open", name="a.mcap", rate=4.0, loop=True)
        assert state.replay is not None
        assert (state.replay.rig, state.replay.duration_s) == ("desk-replay", 2.99)
        while len(heard) < 20:
            await asyncio.sleep(0.02)
        await recorder.ask("pause")
        assert (await recorder.replay()).state == "paused"
        await recorder.ask("set", at_s=-1.0, rate=0.5, loop=False)
        replay = await recorder.replay()
        assert (replay.at_s, replay.rate, replay.loop) == (1.99, 0.5, False)
        await recorder.ask("play", at_s=2.9)
        while (await recorder.replay()).state != "ended":
            await asyncio.sleep(0.02)
        assert (await recorder.ask("close")).replay is None
        task.cancel()
    assert set(heard) == {f"rhot/desk-replay/camera/{side}/markers" for side in ("left", "right")}
    with pytest.raises(RefusedError, match="nothing is being replayed"):
        await recorder.ask("play")


async def test_nothing_outside_the_folder_is_opened(
    recorder: Asked, tmp_path: Path, write: Write
) -> None:
    write(tmp_path / "secret.mcap", 10)
    write(recorder.folder / "a.mcap", 10)
    (recorder.folder / "link.mcap").symlink_to(tmp_path / "secret.mcap")
    (recorder.folder / "folder.mcap").mkdir()
    (recorder.folder / "half.mcap").write_bytes(b"\x89MCAP0\r\n123")
    for name, said in (
        ("../secret.mcap", "matching regex"),
        (str(tmp_path / "secret.mcap"), "matching regex"),
        ("..mcap", "matching regex"),
        (None, "needs the name"),
        ("link.mcap", "no recording"),
        ("folder.mcap", "no recording"),
        ("gone.mcap", "no recording"),
        ("half.mcap", "cut off"),
    ):
        # As a stranger might send it: unchecked.
        with pytest.raises(RefusedError, match=said):
            await recorder.ask("open", name=name)
    for values in ({"rate": 0.0}, {"rate": 1e9}, {"at_s": 1e300}):
        with pytest.raises(RefusedError):
            await recorder.ask("open", name="a.mcap", **values)
    assert (await recorder.state()).replay is None
    listed = (await recorder.bus.get(topics.RECORDINGS))[0].recordings
    assert {one.name: one.state for one in listed} == {"a.mcap": "whole", "half.mcap": "damaged"}


async def test_a_recording_that_is_damaged_further_on_says_so(
    recorder: Asked, write: Write
) -> None:
    path = write(recorder.folder / "a.mcap", 300)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    await recorder.ask("open", name="a.mcap", rate=16.0)
    while (state := await recorder.state()).replay is not None:
        await asyncio.sleep(0.02)
    assert "is damaged" in state.note


def test_the_name_of_the_replayed_rig_is_a_name() -> None:
    assert replay_rig("desk") == "desk-replay"
    topics.POSE.key(replay_rig("x" * 64), hand="left")
    assert RigTable(name=replay_rig("x" * 64)).name.endswith("-replay")
