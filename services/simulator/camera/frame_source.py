"""The pictures of one simulated camera as its tracker would get them: number, stamp on its own
clock, bytes. Pure.

Lost frames are said to be lost and are not rendered; their numbers are skipped as a driver skips
them.
"""

from __future__ import annotations

from dataclasses import dataclass

from services.simulator.render.renderer import Bytes, Renderer
from services.simulator.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Shot:
    """When one frame is taken, before anybody renders it."""

    camera: str
    seq: int
    # True instant of mid-exposure of row 0, seconds of the scene.
    time_s: float
    dropped: bool


@dataclass(frozen=True, eq=False)
class TakenFrame:
    """One frame; image is I420 (h * 3 / 2, w) uint8, None if the frame was lost.

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

    @property
    def dropped(self) -> bool:
        return self.image is None


class FrameSource:
    """One camera of a scene.

    recorded=False: the camera computer's clock is as wrong as CameraClock says (live; the tracker
    measures it by echo). recorded=True: only what synchronisation leaves over is wrong (captures;
    offline nobody can ask the time).
    """

    def __init__(self, scene: Scene, camera: str, *, recorded: bool = False) -> None:
        self.clock = scene.clocks[camera]
        self.camera = scene.cameras[camera]
        self.renderer = Renderer(scene, camera)
        self._recorded = recorded

    def shot(self, seq: int) -> Shot:
        """When frame `seq` is taken, and whether it gets lost."""
        return Shot(self.camera.name, seq, self.clock.time_s(seq), self.clock.dropped(seq))

    def take(self, seq: int, start_ns: int = 0) -> TakenFrame:
        """Frame number `seq` since the scene's beginning, which is start_ns on the master's clock."""
        shot = self.shot(seq)
        skew_ns = self.skew_ns(shot.time_s)
        return TakenFrame(
            camera=self.camera.name,
            seq=seq,
            time_s=shot.time_s,
            stamp_ns=max(
                0, start_ns + round(shot.time_s * 1e9) + skew_ns + self.clock.stamp_error_ns(seq)
            ),
            skew_ns=skew_ns,
            row_time_ns=self.clock.row_time_ns,
            size_px=self.camera.size_px,
            image=None if shot.dropped else self.renderer.picture(seq),
        )

    def skew_ns(self, time_s: float) -> int:
        """How far the clock that stamps is ahead of the master's."""
        return self.clock.residual_at_ns(time_s) if self._recorded else self.clock.skew_ns(time_s)
