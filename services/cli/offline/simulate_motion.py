"""`rhot simulate --motion FILE`: a recording of a real hand before the virtual cameras.

Where bones fit the recording, a hand is rendered; where none fit, markers are written without
pictures, which `rhot track` takes as well. What was done is said.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from rhot.files.config import RigConfig
from services.simulator.camera.marker_source import share_in_view
from services.simulator.files.capture_writer import write_capture
from services.simulator.files.marker_capture import write_marker_capture
from services.simulator.recorded_motion.bones import DrivenHand
from services.simulator.recorded_motion.scenes import (
    MotionView,
    load_motion,
    point_scene,
    recorded_scene,
)

Advance = Callable[[int, int], None]


class SimulatedMotion(msgspec.Struct, frozen=True, kw_only=True):
    """What was written of a recording.

    mode: `hand` was rendered, `points` gave markers without pictures. frames: pictures or marker
    frames. recorded_s: how long the recording's stretch lasts at this speed; to_and_fro: it was
    shorter than seconds. worst_tip_mm: how far the hand's tips are from the recording's at most.
    in_view: share of wrist and tips inside all pictures.
    """

    capture: str
    motion: str
    mode: Literal["hand", "points"]
    hand: str
    seed: int
    seconds: float
    recorded_s: float
    to_and_fro: bool
    frames: int
    worst_tip_mm: float | None
    in_view: float


@dataclass(frozen=True)
class MotionRequest:
    """Options of the command of the same names; seconds None: as long as the recording."""

    path: Path
    seconds: float | None
    distance_m: float
    speed: float
    seed: int


def write_motion(
    config: RigConfig, request: MotionRequest, out: Path, advance: Advance
) -> SimulatedMotion:
    """Write a capture of a recording. Raises RhotError."""
    recorded = load_motion(request.path)
    recorded_s = float(recorded.times_s[-1]) / request.speed
    seconds = recorded_s if request.seconds is None else request.seconds
    view = MotionView(seconds, request.distance_m, request.speed, request.seed)
    points = point_scene(config, recorded, view)
    worst_tip_mm = None
    if isinstance(recorded, DrivenHand):
        worst_tip_mm = round(1e3 * float(recorded.gap_m.max()), 4)
        frames = write_capture(recorded_scene(config, recorded, view), seconds, out, advance)
    else:
        frames = write_marker_capture(points, seconds, out)
    return SimulatedMotion(
        capture=str(out),
        motion=str(request.path),
        mode="points" if worst_tip_mm is None else "hand",
        hand=recorded.hand,
        seed=request.seed,
        seconds=round(seconds, 3),
        recorded_s=round(recorded_s, 3),
        to_and_fro=seconds > recorded_s + 1e-9,
        frames=frames,
        worst_tip_mm=worst_tip_mm,
        in_view=round(share_in_view(points, seconds), 4),
    )


def motion_text(made: SimulatedMotion) -> str:
    """A few lines for people."""
    if made.mode == "hand":
        what = (
            f"a {made.hand} hand with the recording's bones, its tips within"
            f" {made.worst_tip_mm:.3f} mm of it; {made.frames} pictures"
        )
    else:
        what = (
            f"points of a {made.hand} hand, as no bones fit them; {made.frames} frames of markers"
            " without pictures"
        )
    ends = (
        f"to and fro, as the recording lasts {made.recorded_s:g} s" if made.to_and_fro else "once"
    )
    lines = [f"{made.capture}: {made.seconds:g} s of {made.motion}, {ends}", what]
    if made.in_view < 1.0:
        lines.append(
            f"{100.0 * made.in_view:.1f} % of wrist and tips are inside all pictures;"
            " --distance moves the hand away"
        )
    return "\n".join([*lines, f"next: rhot track {made.capture} --out result"])
