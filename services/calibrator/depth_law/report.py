"""What `rhot calibrate depth` prints of a depth law. Pure text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from services.calibrator.depth_law.fit import PAPER_K, PAPER_Z, DepthLaw


def depth_text(law: DepthLaw) -> str:
    """The parameters for rig.toml, and the residuals of each law at each distance."""
    columns = (law.power_cm, law.geometry_cm, law.explained_cm)
    rows = zip(law.distances_cm, law.disparities_px, *columns, strict=True)
    power_rms, geometry_rms, explained_rms = (f"{_rms(column):.2f}" for column in columns)
    turned_deg, zero_mm = math.degrees(law.divergence_rad), 10.0 * law.zero_cm
    power = f"k = {law.k:.1f}, z = {law.z:.4f} (the paper's rig: {PAPER_K}, {PAPER_Z})"
    causes = (
        f"cameras turned away from each other by {turned_deg:.3f} degrees, "
        f"the tape's zero {zero_mm:.1f} mm in front of the optical centres"
    )
    lines = [
        "  distance cm   disparity px   D = k x^z   D = k / x   geometry   (errors in cm)",
        *(
            f"  {D:>11.1f} {x:>14.2f} {power:>+11.2f} {geometry:>+11.2f} {explained:>+10.2f}"
            for D, x, power, geometry, explained in rows
        ),
        f"  {'RMS':>11} {'':>14} {power_rms:>11} {geometry_rms:>11} {explained_rms:>10}",
        f"  D = k x^z, RHOT eq. (9): {power}",
        f"  D = k / x, RHOT eq. (10): phi = {math.degrees(law.phi_rad):.3f} degrees",
        f"  geometry: {causes}",
        "Paste into rig.toml:",
        "[fusion.disparity]",
        f"k = {law.k:.1f}",
        f"z = {law.z:.4f}",
        f"phi_rad = {law.phi_rad:.5f}",
    ]
    return "\n".join(lines)


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))
