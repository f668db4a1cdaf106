"""The steps of a guided calibration, in the order in which they build on each other. Pure data.

What to do in plain sentences, a small picture where it helps, the same on the command line, and the
files by which a step is known to be done. Of a simulated rig, what there is to practise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from rhot.files.config import RigConfig
from services.viewer.guide import drawings

StepName = Literal["camera", "colours", "lens", "stereo", "hand", "objects"]


@dataclass(frozen=True)
class Step:
    """One step; files and commands are of a rig. error is the figure of a file that counts.

    practice is what happens on a simulated rig.
    """

    name: StepName
    title: str
    what: str
    drawing: str
    files: Callable[[RigConfig], list[str]]
    command: Callable[[RigConfig], str]
    error: str = ""
    unit: str = ""
    practice: str = ""


def _cameras(config: RigConfig) -> list[str]:
    return [camera.name for camera in config.camera]


def _first(config: RigConfig) -> str:
    return next(iter(_cameras(config)), "left")


def _hand(config: RigConfig) -> str:
    return next(iter(config.hand), "right")


STEPS: tuple[Step, ...] = (
    Step(
        "camera",
        "Camera",
        "Hold the painted hand where it will be used, in the light that it will be used in. "
        "Each camera measures the light once, and keeps its exposure and colours from then on.",
        drawings.CAMERA,
        lambda config: [f"{name}.exposure.json" for name in _cameras(config)],
        lambda config: f"rhot calibrate camera {_first(config)} --auto",
        practice="Its light is always right: there is nothing to measure.",
    ),
    Step(
        "colours",
        "Colours",
        "Hold the painted hand still before the camera. "
        "Click the middle of each dab of paint in the picture, in the order that you are asked. "
        "Or move it about for three seconds, fingers apart, and press 'propose all'.",
        drawings.COLOURS,
        lambda config: [f"{name}.colors.json" for name in _cameras(config)],
        lambda config: f"rhot calibrate colors {_first(config)} --auto",
        practice="Its colours are known already; clicking on them works as on a real hand.",
    ),
    Step(
        "lens",
        "Lens",
        "Show the printed chessboard to one camera, and hold it still until it counts. "
        "Then move it: into every corner of the picture, near and far, and tilted.",
        drawings.BOARD,
        lambda config: [f"{name}.lens.json" for name in _cameras(config)],
        lambda config: f"rhot calibrate lens {_first(config)} pictures --live --config rig.toml",
        "held_out_px",
        "px",
        practice="Press Start: a board with squares of 25 mm is carried before the camera.",
    ),
    Step(
        "stereo",
        "Places of the cameras",
        "Show the same board to all cameras at once, and hold it still until it counts. "
        "Fasten the cameras before: whoever moves one later has to do this step again.",
        drawings.STEREO,
        lambda _: ["rig.json"],
        lambda _: "rhot calibrate stereo pictures --live --config rig.toml",
        "epipolar_px",
        "px",
        practice="Press Start: a board with squares of 25 mm is carried before all cameras.",
    ),
    Step(
        "hand",
        "Hand",
        "Measure how long your bones are. Follow twelve short exercises of four seconds each: that "
        "is the most exact. Or just use the painted hand for a minute, in view of both cameras.",
        drawings.HAND,
        lambda config: [f"hand.{name}.json" for name in config.hand],
        lambda config: f"rhot calibrate hand {_hand(config)} --config rig.toml",
        practice="Press Start: its hand does the exercises, twice as fast as you would, "
        "or moves as it likes.",
    ),
    Step(
        "objects",
        "Objects",
        "Take the tracker with its dab of paint and move it slowly through the whole space. "
        "Turn it all the while, with the paint towards the cameras.",
        drawings.OBJECTS,
        lambda config: ["objects.json"] if config.object else [],
        lambda _: "rhot calibrate objects --config rig.toml",
        "held_out_mm",
        "mm",
        practice="Press Start: the painted tracker is moved and turned.",
    ),
)
# What the calibrator measures; the others are between the page and the cameras' trackers.
OF_THE_CALIBRATOR = ("lens", "stereo", "hand", "objects")


def steps_of(config: RigConfig) -> list[Step]:
    """The steps that a rig needs."""
    left_out = set[str]()
    if not config.has_depth:
        left_out |= {"stereo", "hand"}
    if not config.hand:
        left_out.add("hand")
    if not config.object:
        left_out.add("objects")
    return [step for step in STEPS if step.name not in left_out]
