"""What `rhot calibrate hand` prints of a calibrated hand. Pure text."""

from __future__ import annotations

from rhot.hand import TIPS
from services.calibrator.hand.fit import FRAMES
from services.calibrator.output.hand_file import HandFile

_SOURCES = {
    "data": "determined by the data",
    "partly": "partly; else the table",
    "table": "from the table, at the size of this hand",
    "by hand": "measured by hand",
}


def report_text(made: HandFile) -> str:
    """A table for people."""
    lines = [f"{'length':26} {'table':>7} {'estimate':>9} {'sigma':>6}  (mm)"]
    for length in made.lengths:
        table, estimate, sigma = (
            1e3 * value for value in (length.table_m, length.estimate_m, length.sigma_m)
        )
        numbers = f"{table:7.1f} {estimate:9.1f} {sigma:6.1f}"
        lines.append(f"{length.name:26} {numbers}  {_SOURCES[length.source]}")
    return "\n".join([*lines, *(_free_motion(made) if made.size else _exercises(made))])


def proposal_text(made: HandFile) -> str:
    """One line on a hand that measured itself."""
    known = " ".join(f"{n} {1e3 * s:.0f}" for n, s in made.knuckle_sigma_m.items())
    return (
        f"after {made.seconds:.0f} s of motion: size {made.size:.2f}, knuckles within (mm) {known}"
    )


def _exercises(made: HandFile) -> list[str]:
    reached = ", ".join(f"{name} {angle:.0f}" for name, angle in made.reached_deg.items())
    return [
        f"bends reached (deg): {reached}",
        _paint(made),
        (
            f"{made.frames} frames (at most {FRAMES} an exercise), "
            f"residual {1e3 * made.residual_m:.2f} mm per coordinate"
        ),
    ]


def _free_motion(made: HandFile) -> list[str]:
    not_bent = [
        f"the {digit} finger was hardly bent: its bones stay the tables', at this size"
        for digit in made.not_bent
    ]
    return [
        proposal_text(made),
        *not_bent,
        _paint(made),
        (
            f"{made.frames} frames of free motion, "
            f"residual {1e3 * made.residual_m:.2f} mm per coordinate; the 48 s of exercises are "
            "more exact (`rhot calibrate hand --list`)"
        ),
    ]


def _paint(made: HandFile) -> str:
    paint = ", ".join(
        f"{name.removesuffix('_tip')} {1e3 * made.paint[name].offset_m[2]:.1f}" for name in TIPS
    )
    return (
        f"middle of the paint, mm before the end of the finger: {paint} "
        "(tips alone show only bone minus paint)"
    )
