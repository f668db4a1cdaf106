"""The simulator live: pictures of every simulated camera, poses of every simulated tracker, and the
ground truth, in real time.

Each camera runs at its own phase, in a thread of its own; a picture is published when a real one
would have arrived. The true time is CLOCK_REALTIME of this machine, which is the master's; the
clock of a simulated camera computer is off by SimFrame.clock_skew_ns, and can be set
(computer_clocks.py). Which scene is shown, covered paint, bumped cameras and calibration boards are
set while it runs (stage.py). Cameras and hands stay those of the calibration that it began with,
whatever is saved meanwhile. Late: a camera that cannot keep up skips frames and counts them in
health. Uncalibrated: the service ends with the error that names the command. Nobody listens: it
runs on.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import msgspec

from rhot import topics
from rhot.files.config import RigConfig
from rhot.messages.simulator import SimFrame, SimStage
from rhot.process.service import Service
from services.simulator.camera.frame_source import FrameSource, TakenFrame
from services.simulator.computer_clocks import ComputerClocks
from services.simulator.files.calibration_kept import calibration_kept
from services.simulator.scene.scene import Scene
from services.simulator.scene.vive_trackers import tracker_pose
from services.simulator.stage import Stage

# From the last row's exposure to the picture in memory: the image processor of a Raspberry Pi.
_PROCESSING_S = 3e-3
# How often it is looked whether somebody's lease of the stage is over.
_LEASES_S = 0.5
# Share of the newest value in the running mean of the rendering time.
_SMOOTHING = 0.05


class SceneClock:
    """Seconds since the scene began, and that beginning on the master's clock, which may be slewed
    or set meanwhile.
    """

    def __init__(self) -> None:
        self._began_ns = time.monotonic_ns()

    def now_s(self) -> float:
        """Scene time."""
        return (time.monotonic_ns() - self._began_ns) * 1e-9

    def start_ns(self) -> int:
        """The scene's beginning as the master's clock has it now."""
        return time.time_ns() - (time.monotonic_ns() - self._began_ns)

    async def ticks(
        self, period_s: float, phase_s: float = 0.0
    ) -> AsyncIterator[tuple[int, float]]:
        """(number, scene time) of instants a period apart, each as it comes.

        Those missed by more than a period are left out.
        """
        number = 0
        while True:
            due_s = phase_s + number * period_s
            now_s = self.now_s()
            if now_s - due_s > period_s:
                number += int((now_s - due_s) / period_s)
                continue
            await asyncio.sleep(max(0.0, due_s - now_s))
            yield number, due_s
            number += 1


async def serve(service: Service) -> None:
    """Renders a virtual rig live: camera pictures, tracker poses and the ground truth."""
    cv2.setNumThreads(1)
    config = service.config
    names = [c.name for c in config.camera if c.source == "simulator"]
    with (
        TemporaryDirectory(prefix="rhot-simulator-") as folder,
        ThreadPoolExecutor(max(1, len(names)), "camera") as threads,
    ):
        stage = Stage(config, calibration_kept(config, Path(folder)))
        sources = [
            await asyncio.get_running_loop().run_in_executor(
                threads, _compiled, stage.seen_by(name), name
            )
            for name in names
        ]
        clock, computers = SceneClock(), ComputerClocks(names)
        # One change after the other: each takes its time, in a thread.
        turns = asyncio.Lock()
        service.bus.answer_requests(topics.SIM_STAGE, partial(_answer_stage, stage, clock, turns))
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(_end_leases(stage, clock, turns))
            for source in sources:
                camera = _LiveCamera(service, source, stage, threads)
                tasks.create_task(_run_camera(camera, clock, computers))
            tasks.create_task(_publish_truth(service, stage, clock))
            if config.objects.source == "simulator":
                tasks.create_task(_publish_tracker_poses(service, stage, clock, config))
            service.ready()


def _compiled(scene: Scene, camera: str) -> FrameSource:
    """A camera whose kernels are compiled: most of a minute on a slow machine, the first time."""
    source = FrameSource(scene, camera)
    source.renderer.picture(0)
    return source


async def _answer_stage(
    stage: Stage, clock: SceneClock, turns: asyncio.Lock, payload: bytes
) -> SimStage:
    """What is shown, after the change that a request asks for."""
    if payload:
        # Where a hand takes an object is searched for: that takes longer than a frame.
        wanted = msgspec.json.decode(payload, type=SimStage)
        async with turns:
            await asyncio.to_thread(stage.set, wanted, clock.now_s)
    return stage.wanted


async def _end_leases(stage: Stage, clock: SceneClock, turns: asyncio.Lock) -> None:
    """Take away, for ever, what was shown for somebody who is gone."""
    while True:
        await asyncio.sleep(_LEASES_S)
        async with turns:
            await asyncio.to_thread(stage.end_lease, clock.now_s)


class _LiveCamera:
    """One camera's pictures, of what is on the stage at the time."""

    def __init__(
        self, service: Service, source: FrameSource, stage: Stage, threads: ThreadPoolExecutor
    ) -> None:
        self.service, self.source = service, source
        self._stage, self._shown, self._threads = stage, stage.changes, threads

    async def take(self, seq: int, start_ns: int) -> TakenFrame:
        """Frame `seq`, rendered in a thread."""
        return await asyncio.get_running_loop().run_in_executor(
            self._threads, self._take, seq, start_ns
        )

    def _take(self, seq: int, start_ns: int) -> TakenFrame:
        if self._shown != self._stage.changes:
            self._shown = self._stage.changes
            name = self.source.camera.name
            self.source = FrameSource(self._stage.seen_by(name), name)
        return self.source.take(seq, start_ns)


async def _run_camera(live: _LiveCamera, clock: SceneClock, computers: ComputerClocks) -> None:
    """Render and publish the frames of one camera, for ever."""
    service, source = live.service, live.source
    name, timing = source.camera.name, source.clock
    publisher = service.bus.publisher(topics.SIM_FRAME, camera=name)
    service.bus.answer_requests(topics.SIM_CLOCK, partial(computers.answer, name), camera=name)
    # From mid-exposure of row 0 to the picture in memory.
    readout_s = source.camera.size_px[1] * timing.row_time_ns * 1e-9
    delay_s = 0.5 * timing.exposure_s + readout_s + _PROCESSING_S
    values = service.values
    values.update({f"{name}_skipped": 0.0, f"{name}_lost": 0.0, f"{name}_render_ms": 0.0})
    seq = timing.first_frame(clock.now_s())
    while True:
        late_s = clock.now_s() - timing.time_s(seq) - delay_s
        if late_s > timing.period_s:
            skipped = int(late_s / timing.period_s)
            values[f"{name}_skipped"] += skipped
            seq += skipped
        began_s, ahead_ns = clock.now_s(), computers.ahead_ns(name)
        frame = await live.take(seq, clock.start_ns())
        if frame.image is None:
            values[f"{name}_lost"] += 1
        else:
            render_ms = 1e3 * (clock.now_s() - began_s)
            values[f"{name}_render_ms"] += _SMOOTHING * (render_ms - values[f"{name}_render_ms"])
            await asyncio.sleep(max(0.0, frame.time_s + delay_s - clock.now_s()))
            header = _header(frame, ahead_ns)
            publisher.put_bytes(frame.image.tobytes(), attachment=header)
        seq += 1


def _header(frame: TakenFrame, ahead_ns: int) -> SimFrame:
    """What travels with a picture of a camera whose computer's clock was set that far ahead."""
    return SimFrame(
        camera=frame.camera,
        seq=frame.seq,
        stamp_ns=max(0, frame.stamp_ns + ahead_ns),
        row_time_ns=frame.row_time_ns,
        size_px=frame.size_px,
        clock_skew_ns=frame.skew_ns + ahead_ns,
        full_range=frame.full_range,
    )


async def _publish_truth(service: Service, stage: Stage, clock: SceneClock) -> None:
    """The ground truth at every instant of the first camera."""
    publisher = service.bus.publisher(topics.TRUTH)
    first = next(iter(stage.scene.clocks.values()))
    async for _, t_s in clock.ticks(first.period_s, first.phase_s):
        publisher.put(stage.scene.truth(t_s, clock.start_ns() + round(t_s * 1e9)))


async def _publish_tracker_poses(
    service: Service, stage: Stage, clock: SceneClock, config: RigConfig
) -> None:
    """The pose of every object's Vive tracker, at the rate of rig.toml."""
    publishers = [
        service.bus.publisher(topics.OPENVR, serial=item.serial) for item in stage.scene.objects
    ]
    async for seq, t_s in clock.ticks(1.0 / config.objects.rate_hz):
        stamp_ns, scene = clock.start_ns() + round(t_s * 1e9), stage.scene
        for index, (item, publisher) in enumerate(
            zip(scene.objects, publishers, strict=True), start=1
        ):
            publisher.put(tracker_pose(scene, item, index, t_s, seq, stamp_ns))
