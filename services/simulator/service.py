"""The simulator live: pictures of every simulated camera, poses of every simulated tracker, and the
ground truth, in real time.

Each camera runs at its own phase, in a thread of its own; a picture is published when a real one
would have arrived. The true time is CLOCK_REALTIME of this machine, which is the master's; the
clock of a simulated camera computer is off by SimFrame.clock_skew_ns, and can be set
(computer_clocks.py). Late: a camera that cannot keep up skips frames and counts them in health.
Uncalibrated: the service ends with the error that names the command. Nobody listens: it runs on.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import cv2

from rhot import topics
from rhot.files.config import RigConfig
from rhot.messages.simulator import SimFrame
from rhot.process.service import Service
from services.simulator.camera.frame_source import FrameSource, TakenFrame
from services.simulator.computer_clocks import ComputerClocks
from services.simulator.recorded_motion.scenes import live_scene
from services.simulator.scene.scene import Scene
from services.simulator.scene.vive_trackers import tracker_pose

# From the last row's exposure to the picture in memory: the image processor of a Raspberry Pi.
_PROCESSING_S = 3e-3
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
    scene = live_scene(config)
    names = [c.name for c in config.camera if c.source == "simulator"]
    with ThreadPoolExecutor(max(1, len(names)), "camera") as threads:
        sources = [
            await asyncio.get_running_loop().run_in_executor(threads, _compiled, scene, name)
            for name in names
        ]
        clock, computers = SceneClock(), ComputerClocks(names)
        async with asyncio.TaskGroup() as tasks:
            for source in sources:
                tasks.create_task(_run_camera(service, source, clock, computers, threads))
            tasks.create_task(_publish_truth(service, scene, clock))
            if config.objects.source == "simulator":
                tasks.create_task(_publish_tracker_poses(service, scene, clock, config))
            service.ready()


def _compiled(scene: Scene, camera: str) -> FrameSource:
    """A camera whose kernels are compiled: most of a minute on a slow machine, the first time."""
    source = FrameSource(scene, camera)
    source.renderer.picture(0)
    return source


async def _run_camera(
    service: Service,
    source: FrameSource,
    clock: SceneClock,
    computers: ComputerClocks,
    threads: ThreadPoolExecutor,
) -> None:
    """Render and publish the frames of one camera, for ever."""
    loop = asyncio.get_running_loop()
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
        frame = await loop.run_in_executor(threads, source.take, seq, clock.start_ns())
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


async def _publish_truth(service: Service, scene: Scene, clock: SceneClock) -> None:
    """The ground truth at every instant of the first camera."""
    publisher = service.bus.publisher(topics.TRUTH)
    first = next(iter(scene.clocks.values()))
    async for _, t_s in clock.ticks(first.period_s, first.phase_s):
        publisher.put(scene.truth(t_s, clock.start_ns() + round(t_s * 1e9)))


async def _publish_tracker_poses(
    service: Service, scene: Scene, clock: SceneClock, config: RigConfig
) -> None:
    """The pose of every object's Vive tracker, at the rate of rig.toml."""
    publishers = [
        service.bus.publisher(topics.OPENVR, serial=item.serial) for item in scene.objects
    ]
    async for seq, t_s in clock.ticks(1.0 / config.objects.rate_hz):
        stamp_ns = clock.start_ns() + round(t_s * 1e9)
        for index, (item, publisher) in enumerate(
            zip(scene.objects, publishers, strict=True), start=1
        ):
            publisher.put(tracker_pose(scene, item, index, t_s, seq, stamp_ns))
