"""What a calibration found, as numbers for a file and lines for a person. Pure.

A length is called determined by how much of the tables' spread the recording took away; what it
left is the table's.
"""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, TIPS, Digit, HandModel
from services.calibrator.hand.adjust import Adjusted
from services.calibrator.hand.fit import FRAMES
from services.calibrator.hand.hand_parameters import SIZE, Shape
from services.calibrator.hand.problem import Problem

# Share of the spread that the tables leave at a known size of the hand: at 0.6 the recording weighs
# twice what the table does.
_DETERMINED, _PARTLY = 0.6, 0.85
_BONES = (("metacarpal", "proximal", "distal"), *(("proximal", "middle", "distal"),) * 4)

Source = Literal["data", "partly", "table", "by hand"]
_WORDS = {
    "data": "determined by the data",
    "partly": "partly; else the table",
    "table": "from the table, at the size of this hand",
    "by hand": "measured by hand",
}


class Length(msgspec.Struct, frozen=True, kw_only=True):
    """One length, in metres."""

    name: str
    table_m: float
    estimate_m: float
    sigma_m: float
    source: Source


class HandFile(HandModel, frozen=True, kw_only=True):
    """hand.<hand>.json: the model that solver and fusion read, and how it came about."""

    inputs: str = ""
    frames: int = 0
    residual_m: float = 0.0
    lengths: list[Length] = msgspec.field(default_factory=list)
    # Largest angles the exercises showed, deg: of each finger at the knuckle and at its middle
    # joint.
    reached_deg: dict[str, float] = msgspec.field(default_factory=dict)


def hand_file(
    problem: Problem, found: Adjusted, table: HandModel, *, date: str, inputs: str
) -> HandFile:
    """Everything that goes into the file.

    Table is the hand that the estimates are compared with.
    """
    shape = problem.shape
    model = shape.model(found.x)
    distances = found.found.distances
    # Whitened distances back to metres, per coordinate.
    residual = float(
        np.sqrt((distances**2 / np.maximum(problem.weights.mean(axis=2), 1.0)).mean() / 3.0)
    )
    reached = _reached(problem, found)
    digits = tuple(_widened(digit, reached) for digit in model.digits)
    fields = {name: getattr(model, name) for name in model.__struct_fields__}
    return HandFile(
        **fields
        | {
            "digits": digits,
            "origin": "measured",
            "date": date,
            "tool": "rhot calibrate hand",
            "inputs": inputs,
            "frames": len(distances),
            "residual_m": round(residual, 6),
            "lengths": _lengths(shape, found, table, shape.geometry(found.x).G),
            "reached_deg": reached,
        }
    )


def report_text(made: HandFile) -> str:
    """A table for people."""
    lines = [f"{'length':26} {'table':>7} {'estimate':>9} {'sigma':>6}  (mm)"]
    for length in made.lengths:
        numbers = f"{1e3 * length.table_m:7.1f} {1e3 * length.estimate_m:9.1f} {1e3 * length.sigma_m:6.1f}"
        lines.append(f"{length.name:26} {numbers}  {_WORDS[length.source]}")
    reached = ", ".join(f"{name} {angle:.0f}" for name, angle in made.reached_deg.items())
    lines.append(f"bends reached (deg): {reached}")
    paint = ", ".join(
        f"{name.removesuffix('_tip')} {1e3 * made.paint[name].offset_m[2]:.1f}" for name in TIPS
    )
    lines.append(
        f"middle of the paint, mm before the end of the finger: {paint} (tips alone show only bone minus paint)"
    )
    lines.append(
        f"{made.frames} frames (at most {FRAMES} an exercise), residual {1e3 * made.residual_m:.2f} mm per coordinate"
    )
    return "\n".join(lines)


def _lengths(shape: Shape, found: Adjusted, table: HandModel, G: Array) -> list[Length]:
    model = shape.model(found.x)
    # The size is known from the open hand at once; what is asked here is what the exercises add.
    own_G = np.delete(G, SIZE, axis=1)
    after, before = G @ found.covariance @ G.T, own_G @ own_G.T
    rows = []

    def add(name: str, was: float, now: float, row: Array, by_hand: bool = False) -> None:
        sigma, prior = (float(np.sqrt(np.maximum(row @ C @ row, 0.0))) for C in (after, before))
        left = sigma / prior if prior > 0.0 else 0.0
        source: Source = (
            "by hand"
            if by_hand
            else "data"
            if left < _DETERMINED
            else "partly"
            if left < _PARTLY
            else "table"
        )
        rows.append(
            Length(
                name=name,
                table_m=round(was, 6),
                estimate_m=round(now, 6),
                sigma_m=round(sigma, 6),
                source=source,
            )
        )

    for d, digit in enumerate(DIGITS):
        own, tip = np.zeros(len(G)), shape.names.index(TIPS[d])
        if d > 0:
            along = np.array(model.digits[d].base_m) - np.array(model.digits[d].metacarpal_m)
            was = np.array(table.digits[d].base_m) - np.array(table.digits[d].metacarpal_m)
            row = np.zeros(len(G))
            row[15 + 3 * d : 18 + 3 * d] = along / np.linalg.norm(along)
            row[30 + 3 * d : 33 + 3 * d] = -along / np.linalg.norm(along)
            add(
                f"{digit} metacarpal", float(np.linalg.norm(was)), float(np.linalg.norm(along)), row
            )
        for bone, name in enumerate(_BONES[d]):
            row = np.zeros(len(G))
            row[3 * d + bone] = own[3 * d + bone] = 1.0
            add(
                f"{digit} {name}",
                table.digits[d].lengths_m[bone],
                model.digits[d].lengths_m[bone],
                row,
                (d, bone) in shape.known,
            )
        own[60 + 3 * tip + 2] = -1.0
        sums = [sum(m.digits[d].lengths_m) - m.paint[TIPS[d]].offset_m[2] for m in (table, model)]
        add(f"{digit}, root to paint", sums[0], sums[1], own)
    return rows


def _reached(problem: Problem, found: Adjusted) -> dict[str, float]:
    """Largest bends, deg; a hundredth of the frames may be wrong."""
    reached = {}
    for number, take in enumerate(problem.takes):
        if take.name.endswith(("_knuckle", "_hook")):
            # The first moving angle of these takes is the exercised one.
            bends = found.poses.moving[problem.take_of == number, 0]
            reached[take.name.replace("_", " ")] = round(
                float(np.rad2deg(np.percentile(bends, 99))), 1
            )
    return reached


def _widened(digit: Digit, reached: dict[str, float]) -> Digit:
    """Limits grow to what was reached.

    What was not asked to its end says nothing, so they never shrink.
    """
    limits = list(digit.limits_rad)
    for column, kind in ((1, "knuckle"), (2, "hook")):
        high = np.deg2rad(min(reached.get(f"{digit.name} {kind}", 0.0), 130.0))
        limits[column] = (limits[column][0], round(float(max(limits[column][1], high)), 6))
    return msgspec.structs.replace(digit, limits_rad=tuple(limits))
