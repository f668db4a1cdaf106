"""Faults of the real process: `rhot-fusion` behind a real router, fed with a synthetic hand."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import signal
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import msgspec
import pytest
import pytest_asyncio

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.files.calibration import save
from testing.calibration_files import lens_of, save_calibration
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

pytestmark = pytest.mark.integration
# numba's first compilation on a loaded machine takes most of it.
START_S, RECOVERY_S = 120.0, 0.5
# A machine that is busy with something else may need longer: it is asked so often.
TRIES = 4
SETUP = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4, skew_s=0.0, drift_ppm=0.0, loss=0.0)
FUSION = Path(sys.executable).parent / "rhot-fusion"


@pytest.fixture
def rig_toml(tmp_path, router) -> Path:
    """The synthetic rig on disk, calibrated."""
    save_calibration(tmp_path / "calibration", SETUP.rig().values())
    markers = "\n".join(
        f'{name} = "{color}"' for name, color in SETUP.config().hand["right"].markers.items()
    )
    cameras = "\n".join(f'[[camera]]\nname = "{name}"\n' for name in SETUP.names)
    path = tmp_path / "rig.toml"
    rig = f'[rig]\nname = "bench"\n[bus]\nconnect = ["{router}"]\n'
    path.write_text(f"{rig}{cameras}\n[hand.right.markers]\n{markers}\n", encoding="utf-8")
    return path


@contextlib.asynccontextmanager
async def fusion(rig_toml: Path) -> AsyncIterator[asyncio.subprocess.Process]:
    """The process; killed at the end if a test left it."""
    process = await asyncio.create_subprocess_exec(
        str(FUSION),
        "--config",
        str(rig_toml),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGCONT)
            process.terminate()
        await asyncio.wait_for(process.communicate(), 60.0)


class Feed:
    """Plays the synthetic hand in real time, and remembers when points came."""

    def __init__(self, bus) -> None:
        self._bus = bus
        self.arrivals: list[tuple[float, int]] = []  # loop time, measured points
        self.last_error = ""

    async def play(self) -> None:
        publishers = {
            name: self._bus.publisher(topics.MARKERS, camera=name) for name in SETUP.names
        }
        given = frames(SETUP, MovingHand(), 300.0)
        begin_ns = clock.now_ns()
        for frame in given:
            late_ns = (frame.stamp_ns - START_NS) - (clock.now_ns() - begin_ns)
            if late_ns > 0:
                await asyncio.sleep(late_ns * 1e-9)
            publishers[frame.camera].put(
                msgspec.structs.replace(frame, stamp_ns=frame.stamp_ns - START_NS + begin_ns)
            )

    async def hear(self) -> None:
        async for message in self._bus.every(topics.POINTS, 256):
            measured = sum(point.source == "measured" for point in message.points)
            self.arrivals.append((asyncio.get_running_loop().time(), measured))

    async def health(self) -> None:
        async for message in self._bus.every(topics.HEALTH, 16):
            for fault in message.faults:
                self.last_error = f"{fault.text}; {fault.action}"

    def full_since(self, instant_s: float) -> bool:
        return any(at_s >= instant_s and measured == 6 for at_s, measured in self.arrivals)


@pytest_asyncio.fixture
async def feed(router) -> AsyncIterator[Feed]:
    async with open_bus("bench", [router]) as bus:
        found = Feed(bus)
        tasks = [asyncio.create_task(job) for job in (found.play(), found.hear(), found.health())]
        yield found
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def until(condition, seconds: float) -> float:
    """Wait for a condition; how long that took."""
    begin_s = asyncio.get_running_loop().time()
    async with asyncio.timeout(seconds):
        while not condition():
            await asyncio.sleep(0.01)
    return asyncio.get_running_loop().time() - begin_s


async def test_five_seconds_of_silence_and_back_within_half_a_second(rig_toml, feed):
    """The process is stopped, as a machine that swaps or a network that is gone.

    What piled up meanwhile must not be worked off first.
    """
    async with fusion(rig_toml) as process:
        await until(lambda: feed.full_since(0.0), START_S)
        took_s = []
        while min(took_s, default=RECOVERY_S) >= RECOVERY_S and len(took_s) < TRIES:
            process.send_signal(signal.SIGSTOP)
            await asyncio.sleep(5.0)
            process.send_signal(signal.SIGCONT)
            back_s = asyncio.get_running_loop().time()
            took_s.append(await until(lambda since_s=back_s: feed.full_since(since_s), 30.0))
        assert min(took_s) < RECOVERY_S


async def test_a_missing_calibration_is_one_line_and_exit_code_2(rig_toml):
    (rig_toml.parent / "calibration" / "right.lens.json").unlink()
    async with fusion(rig_toml) as process:
        said, _ = await asyncio.wait_for(process.communicate(), START_S)
    assert process.returncode == 2
    assert b"right.lens.json" in said
    assert b"rhot calibrate" in said
    assert b"Traceback" not in said


async def test_a_calibration_of_another_resolution_is_reported_and_gives_no_points(rig_toml, feed):
    path = rig_toml.parent / "calibration" / "right.lens.json"
    camera = SETUP.rig()["right"]
    save(path, msgspec.structs.replace(lens_of(camera), size_px=(1280, 960)))
    async with fusion(rig_toml) as process:
        await until(lambda: "another size" in feed.last_error, START_S)
        assert process.returncode is None
    assert "calibrate" in feed.last_error
    assert not any(measured for _, measured in feed.arrivals)


async def test_a_bumped_camera_reaches_health(rig_toml, feed):
    """The right camera's height is changed by 4.6 px through its calibration: fusion must name the
    pair and the command.
    """
    path = rig_toml.parent / "calibration" / "right.lens.json"
    camera = SETUP.rig()["right"]
    matrix = camera.matrix.copy()
    matrix[1, 2] += 4.6
    save(path, lens_of(dataclasses.replace(camera, matrix=matrix)))
    async with fusion(rig_toml):
        await until(lambda: "rhot calibrate stereo" in feed.last_error, START_S)
    assert "left and right" in feed.last_error
