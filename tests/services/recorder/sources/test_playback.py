"""A recording under control: pause, jump, rate, loop, window."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from rhot.errors import CaptureError
from services.recorder.sources.playback import Playback

Write = Callable[..., Path]


class Played:
    """A playback under way, and the numbers of the messages that it has sent."""

    def __init__(self, path: Path, payload: Callable[[int], bytes], **options: object) -> None:
        self.numbers: list[int] = []
        self._number = {payload(seq): seq for seq in range(1000)}
        self.keys: set[str] = set()
        self.playback = Playback(path, "lab", self._take, **options)  # type: ignore[arg-type]

    def _take(self, key: str, payload: bytes, _encoding: str) -> None:
        self.keys.add(key)
        self.numbers.append(self._number[payload])

    async def until(self, condition: Callable[[], bool]) -> None:
        while not condition():
            await asyncio.sleep(0.005)


@pytest.fixture
def path(tmp_path: Path, write: Write) -> Path:
    """1000 messages, 10 ms apart."""
    return write(tmp_path / "a.mcap")


@contextlib.asynccontextmanager
async def running(played: Played) -> AsyncIterator[Playback]:
    async with asyncio.timeout(30.0), asyncio.TaskGroup() as tasks:
        task = tasks.create_task(played.playback.run())
        yield played.playback
        task.cancel()


async def test_a_window_is_played_whole_and_under_another_rigs_name(
    path: Path, payload: Callable[[int], bytes], start_ns: int
) -> None:
    window = (start_ns + 2_000_000_000, start_ns + 3_000_000_000)
    played = Played(path, payload, rate=0.0, window_ns=window)
    assert await played.playback.run() == 101
    assert played.numbers == list(range(200, 301))
    assert played.keys == {f"rhot/lab/camera/{side}/markers" for side in ("left", "right")}
    assert played.playback.state == "ended"


async def test_pause_jump_and_go_on(path: Path, payload: Callable[[int], bytes]) -> None:
    played = Played(path, payload)
    async with running(played) as playback:
        await played.until(lambda: len(played.numbers) > 3)
        playback.pause()
        await played.until(lambda: playback.state == "paused")
        await asyncio.sleep(0.05)
        before = len(played.numbers)
        start_ns = playback.summary.start_ns
        playback.seek(start_ns + 5_000_000_000)
        assert playback.position_ns == start_ns + 5_000_000_000
        # What is there is shown, and no more.
        await played.until(lambda: len(played.numbers) >= before + 11)
        await asyncio.sleep(0.05)
        assert played.numbers[before:] == list(range(500, 511))
        assert playback.position_ns == start_ns + 5_000_000_000
        playback.play()
        await played.until(lambda: len(played.numbers) > before + 12)
        assert played.numbers[before + 11 : before + 13] == [511, 512]
        # Backwards, flat out: to the end.
        playback.seek(start_ns + 4_000_000_000)
        playback.set_rate(0.0)
        await played.until(lambda: played.numbers[-1] == 999)
    assert played.numbers[-600:] == list(range(400, 1000))


async def test_it_stays_at_its_end_until_somebody_jumps(
    path: Path, payload: Callable[[int], bytes]
) -> None:
    played = Played(path, payload, rate=0.0, stay=True)
    async with running(played) as playback:
        await played.until(lambda: playback.state == "ended")
        playback.play()
        await played.until(lambda: len(played.numbers) == 2000)
        await played.until(lambda: playback.state == "ended")
        playback.seek(0)
        assert playback.state == "paused"
        assert playback.position_ns == playback.window_ns[0]
        playback.play()
        await played.until(lambda: len(played.numbers) == 3000)


async def test_a_loop_of_a_window_goes_round(
    path: Path, payload: Callable[[int], bytes], start_ns: int
) -> None:
    played = Played(path, payload, rate=0.0, loop=True, window_ns=(start_ns, start_ns + 20_000_000))
    async with running(played):
        await played.until(lambda: len(played.numbers) >= 9)
    assert played.numbers[:9] == [0, 1, 2] * 3


async def test_what_cannot_be(path: Path, payload: Callable[[int], bytes]) -> None:
    for options in ({"rate": -1.0}, {"only": ["nonsense"]}):
        with pytest.raises(CaptureError):
            Played(path, payload, **options)
    played = Played(path, payload, rate=0.0, loop=True, only=["hand/pose"])
    with pytest.raises(CaptureError, match="nothing to replay in a loop"):
        await played.playback.run()
