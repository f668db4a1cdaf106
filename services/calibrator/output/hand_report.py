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
    reached = ", ".join(f"{name} {angle:.0f}" for name, angle in made.reached_deg.items())
    paint = ", ".join(
        f"{name.removesuffix('_tip')} {1e3 * made.paint[name].offset_m[2]:.1f}" for name in TIPS
    )
    residual_mm = 1e3 * made.residual_m
    lines += [
        f"bends reached (deg): {reached}",
        (
            f"middle of the paint, mm before the end of the finger: {paint} "
            "(tips alone show only bone minus paint)"
        ),
        (
            f"{made.frames} frames (at most {FRAMES} an exercise), "
            f"residual {residual_mm:.2f} mm per coordinate"
        ),
    ]
    return "\n".join(lines)
