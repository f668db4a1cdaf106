"""MarkerFrames of rendered hands: the simulator's pictures through the tracker."""

from __future__ import annotations

from rhot.files.calibration import load_colors
from rhot.files.config import RigConfig
from rhot.messages import MarkerFrame
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.simulator.camera.frame_source import FrameSource
from services.simulator.scene.scene import Scene
from testing.synthetic_points import START_NS

# How far a camera's clock may be off by its own account: as synchronisation leaves it.
_CLOCK_SIGMA_NS = 500_000


def detect(config: RigConfig, scene: Scene, seconds: float) -> list[MarkerFrame]:
    """All cameras' frames in order of exposure, with what the tracker detects in their pictures.

    Stamps begin at START_NS, at the same instant as the scene.
    """
    found: list[tuple[float, MarkerFrame]] = []
    for name in scene.cameras:
        source = FrameSource(scene, name, recorded=True)
        tracker = step_of_rig(config, name, load_colors(config.calibration_dir, name))
        for seq in range(int(seconds * config.camera_named(name).fps)):
            taken = source.take(seq, START_NS)
            if taken.image is not None:
                frame = Frame(
                    name, seq, taken.stamp_ns, taken.row_time_ns, taken.size_px, taken.image, "i420"
                )
                found.append((taken.time_s, tracker.step(frame, 0, _CLOCK_SIGMA_NS)))
    return [frame for _, frame in sorted(found, key=lambda entry: entry[0])]
