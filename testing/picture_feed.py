"""Pictures of a simulated hand, rendered once and played in a loop, with faults planted into them.

Stands in for the simulator's process on the bus: the trackers that receive the pictures are real.
It costs next to nothing while it plays, and what is wrong with a camera can be said.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.files.config import RigConfig, load_rig
from rhot.messages.simulator import SimFrame
from rhot.process.service import Service
from services.simulator.camera.frame_source import FrameSource
from services.simulator.scene.scene import load_scene

Image = np.ndarray
# From mid-exposure to the picture in memory, as the simulator has it.
_DELAY_S = 0.04
# Luma of black and white in limited range, and chroma of grey.
_BLACK, _WHITE, _GREY = 16, 235, 128


def mirrored(image: Image) -> Image:
    """An I420 picture (h * 3 / 2, w), left and right exchanged."""
    height = image.shape[0] * 2 // 3
    planes = [image[:height, ::-1]]
    for number in range(2):
        rows = image[height + number * height // 4 : height + (number + 1) * height // 4]
        turned = rows.reshape(height // 2, -1)[:, ::-1]
        planes.append(np.ascontiguousarray(turned).reshape(rows.shape))
    return np.concatenate(planes)


def uniform(image: Image, luma: int, seed: int) -> Image:
    """A picture of one grey level, with the noise that every sensor has where it can be seen."""
    height = image.shape[0] * 2 // 3
    noise = np.random.default_rng(seed).integers(-1, 2, image.shape)
    found = np.full(image.shape, _GREY, np.int16)
    found[:height] = luma
    return np.clip(found + noise, 0, 255).astype(np.uint8)


@dataclass
class Camera:
    """One camera's pictures, and what is wrong with it now."""

    name: str
    images: list[Image]
    row_time_ns: float
    phase_s: float
    change: Callable[[Image, int], Image] = lambda image, _: image
    ahead_ns: int = 0
    every: int = 1

    def well(self) -> None:
        """Nothing is wrong any more."""
        self.change, self.ahead_ns, self.every = (lambda image, _: image), 0, 1

    def dark(self) -> None:
        """The lens cap is on."""
        self.change = lambda image, seq: uniform(image, _BLACK, seq)

    def white(self) -> None:
        """A lamp shines into the lens."""
        self.change = lambda image, seq: uniform(image, _WHITE, seq)

    def mirror(self) -> None:
        """hflip is set."""
        self.change = lambda image, _: mirrored(image)

    def slow(self) -> None:
        """Two of three pictures never come."""
        self.every = 3

    def ahead(self) -> None:
        """Its computer's clock is 3 s ahead."""
        self.ahead_ns = 3_000_000_000

    def freeze(self) -> None:
        """The camera hangs, and its driver does not."""
        still = self.images[0]
        self.change = lambda *_: still


@dataclass
class PictureFeed:
    """All cameras of a simulated rig; fps is the rate in its rig.toml."""

    config: RigConfig
    cameras: dict[str, Camera] = field(default_factory=dict)

    @classmethod
    def rendered(cls, path: Path, count: int) -> PictureFeed:
        """count pictures of each camera of a rig.toml. Takes seconds, a minute without kernels."""
        config = load_rig(path)
        scene = load_scene(config)
        feed = cls(config)
        for name in scene.cameras:
            source = FrameSource(scene, name, recorded=True)
            taken = [source.take(seq, 0) for seq in range(count)]
            images = [one.image for one in taken if one.image is not None]
            period_s = 1.0 / config.camera_named(name).fps
            phase_s = taken[0].time_s % period_s
            feed.cameras[name] = Camera(name, images, taken[0].row_time_ns, phase_s)
        return feed

    async def run(self, bus: Bus) -> None:
        """Play for ever, as the rig's service `simulator`."""
        async with asyncio.TaskGroup() as tasks:
            service = Service("simulator", "main", self.config, bus, tasks)
            begin_s = asyncio.get_running_loop().time()
            begin_ns = clock.now_ns()
            for camera in self.cameras.values():
                tasks.create_task(self._play(bus, camera, begin_s, begin_ns))
            service.ready()
            tasks.create_task(service.beat())

    async def _play(self, bus: Bus, camera: Camera, begin_s: float, begin_ns: int) -> None:
        publisher = bus.publisher(topics.SIM_FRAME, camera=camera.name)
        period_s = 1.0 / self.config.camera_named(camera.name).fps
        size_px = self.config.camera_named(camera.name).size_px
        seq = 0
        while True:
            at_s = seq * period_s + camera.phase_s
            late_s = asyncio.get_running_loop().time() - begin_s - at_s - _DELAY_S
            if late_s > period_s:
                seq += int(late_s / period_s)
                continue
            await asyncio.sleep(max(0.0, -late_s))
            seq += 1
            if seq % camera.every:
                continue
            header = SimFrame(
                camera=camera.name,
                seq=seq,
                stamp_ns=begin_ns + round(at_s * 1e9) + camera.ahead_ns,
                row_time_ns=camera.row_time_ns,
                size_px=size_px,
                clock_skew_ns=0,
            )
            image = camera.change(camera.images[seq % len(camera.images)], seq)
            publisher.put_bytes(image.tobytes(), attachment=header)
