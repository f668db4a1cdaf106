"""The frames of one simulated camera as its tracker would get them: number, stamp on the camera
computer's clock, picture. Pure.

A lost frame keeps its number and has no picture; it is not rendered.
"""

from __future__ import annotations

from dataclasses import dataclass

from services.simulator.camera.processing import processed
from services.simulator.render.renderer import Bytes, Renderer
from services.simulator.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class FrameTime:
    """When one frame is exposed, known without rendering it."""

    camera: str
    seq: int
    # True instant of mid-exposure of row 0, seconds of the scene.
    time_s: float
    dropped: bool


@dataclass(frozen=True, eq=False)
class TakenFrame:
    """One frame; image is I420 (h * 3 / 2, w) uint8, None if the frame was lost.

    full_range: Y in 0..255 instead of 16..235.

    stamp_ns is mid-exposure of row 0 on the camera computer's clock, which reads skew_ns more than
    the master's at that instant.
    """

    camera: str
    seq: int
    time_s: float
    stamp_ns: int
    skew_ns: int
    row_time_ns: float
    size_px: tuple[int, int]
    image: Bytes | None
    full_range: bool = False

    @property
    def dropped(self) -> bool:
        return self.image is None


class FrameSource:
    """One camera of a scene.

    recorded=False: stamps have the full clock error of CameraClock (live; the tracker measures it
    against the master). recorded=True: stamps have the residual error only (captures: offline there
    is no master to ask), and pictures have limited range, which captures hold.
    """

    def __init__(self, scene: Scene, camera: str, *, recorded: bool = False) -> None:
        self.clock = scene.clocks[camera]
        self.camera = scene.cameras[camera]
        full_range = scene.config.simulator.full_range and not recorded
        self.renderer = Renderer(scene, camera, full_range=full_range)
        self._recorded = recorded
        self._noise, self._settings = scene.spec.noise, scene.config.simulator

    def frame_time(self, seq: int) -> FrameTime:
        """When frame `seq` is exposed, and whether it is lost."""
        return FrameTime(self.camera.name, seq, self.clock.time_s(seq), self.clock.dropped(seq))

    def take(self, seq: int, start_ns: int = 0) -> TakenFrame:
        """Frame `seq` of a scene that begins at start_ns on the master's clock."""
        frame = self.frame_time(seq)
        skew_ns = self.skew_ns(frame.time_s)
        return TakenFrame(
            camera=self.camera.name,
            seq=seq,
            time_s=frame.time_s,
            stamp_ns=max(
                0, start_ns + round(frame.time_s * 1e9) + skew_ns + self.clock.stamp_error_ns(seq)
            ),
            skew_ns=skew_ns,
            row_time_ns=self.clock.row_time_ns,
            size_px=self.camera.size_px,
            image=None if frame.dropped else self._picture(seq),
            full_range=self.renderer.full_range,
        )

    def skew_ns(self, time_s: float) -> int:
        """How far the stamping clock is ahead of the master's."""
        return self.clock.residual_at_ns(time_s) if self._recorded else self.clock.skew_ns(time_s)

    def _picture(self, seq: int) -> Bytes:
        return processed(self.renderer.picture(seq), self._noise, self._settings)
