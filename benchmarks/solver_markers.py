"""What one more painted knuckle brings, and which gestures wrist and tips cannot tell.

`python benchmarks/solver_markers.py [--json FILE]`. Simulated hands with 1 mm of noise on every
landmark; mean errors in degrees: flexion of the fingers, orientation, thumb, abduction. Gestures
are formed from the open hand and left again by a hand at rest; hardly any of the solver's constants
was tuned on them.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import msgspec
import numpy as np
from solver_hands import FRAMES, RATE_HZ, Motion, errors_of, moving, with_painted

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, HandModel
from services.simulator.hands.gestures import CURVED, FIST, OPEN, LimitScaling, bump
from testing.synthetic_hands import known_hand

_JOINTS = ("proximal", "intermediate")
CANDIDATES = (
    (),
    *(
        (f"{finger}_{joint}",)
        for joint in _JOINTS
        for finger in ("index", "middle", "ring", "little")
    ),
    ("palm",),
    ("middle_metacarpal",),
    *((f"thumb_{joint}",) for joint in ("metacarpal", "proximal", "distal")),
    ("index_proximal", "little_proximal"),
    ("middle_proximal", "thumb_proximal"),
    ("index_proximal", "little_proximal", "thumb_proximal"),
    tuple(f"{finger}_proximal" for finger in ("index", "middle", "ring", "little")),
)


def _with(pose: Array, rows: dict[int, tuple[float, float, float]]) -> Array:
    """A posture in degrees with the abduction, MCP and PIP of some digits replaced."""
    out = pose.copy()
    for row, values in rows.items():
        out[row, :3] = values
    return out


GESTURES = {
    "point": _with(FIST, {1: (2, 12, 14)}),
    "two_fingers": _with(FIST, {1: (8, 10, 12), 2: (0, 10, 12)}),
    "hook": _with(OPEN, {1: (5, 8, 95), 2: (0, 8, 95), 3: (-3, 8, 95), 4: (-7, 10, 90)}),
    "roof": _with(OPEN, {1: (2, 75, 12), 2: (0, 75, 12), 3: (-2, 75, 14), 4: (-4, 72, 16)}),
}
# A relaxed hand that turns about one axis of the wrist: how far in degrees.
SWINGS = {"nod": (30.0, 0.0, 0.0), "fan": (0.0, 25.0, 0.0), "twist": (0.0, 0.0, 45.0)}
_SWING_HZ, _GESTURE_S = 2.5, 2.4


def gesture(model: HandModel, name: str, rng: np.random.Generator) -> Motion:
    """Five seconds of a gesture or a swing of GESTURES and SWINGS, at any orientation."""
    start, fit = moving(model, rng, "fist").rotations[0], LimitScaling(model)
    t = np.arange(FRAMES) / RATE_HZ
    swing = np.deg2rad(SWINGS.get(name, (0.0, 0.0, 0.0)))
    turns = np.outer(np.sin(2.0 * np.pi * _SWING_HZ * t), swing)
    postures = [
        CURVED if name in SWINGS else OPEN + bump(s / _GESTURE_S % 1.0) * (GESTURES[name] - OPEN)
        for s in t
    ]
    rotations = np.array([start @ rotation_from_vector(turn) for turn in turns])
    return Motion(
        rotations,
        np.tile((0.0, 0.0, 0.5), (FRAMES, 1)),
        np.array([fit(posture) for posture in postures]),
    )


def on_the_other_side(name: str, told: bool) -> tuple[float, ...]:
    """Errors when a dab sits on the palm side of a joint, and the hand file says so or not."""
    rows = []
    for seed in range(4):
        back, rng = known_hand(), np.random.default_rng(seed)
        x, y, z = back.paint[name].offset_m
        turned = msgspec.structs.replace(back.paint[name], offset_m=(x, -y, z))
        palm = msgspec.structs.replace(back, paint={**back.paint, name: turned})
        motion = moving(palm, rng, "random" if seed % 2 else "fist")
        rows.append(
            errors_of(palm if told else back, motion, (*BASIC_LANDMARKS, name), rng, painted=palm)
        )
    return tuple(np.mean(rows, axis=0).tolist())


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    found: dict[str, tuple[float, ...]] = {
        "+".join(extra) or "wrist and tips": with_painted(extra, 2) for extra in CANDIDATES
    }
    found["middle_proximal on the palm side, told"] = on_the_other_side("middle_proximal", True)
    found["middle_proximal on the palm side, not told"] = on_the_other_side(
        "middle_proximal", False
    )
    for name in (*GESTURES, *SWINGS):
        rows = []
        for seed in range(4):
            model, rng = known_hand(), np.random.default_rng([seed, 3])
            rows.append(errors_of(model, gesture(model, name, rng), BASIC_LANDMARKS, rng))
        found[name] = tuple(np.mean(rows, axis=0).tolist())
    for name, (flexion, turn, thumb, abduction) in found.items():
        print(
            f"{name:64s} flexion {flexion:5.2f} orientation {turn:5.2f} "
            f"thumb {thumb:5.2f} abduction {abduction:5.2f}"
        )
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
