"""What `rhot calibrate objects` says of its result, for people. Pure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from services.calibrator.objects.points import PointRegistration
from services.calibrator.objects.result import ObjectRegistration, TrackerPlace


def objects_text(found: ObjectRegistration, names: Mapping[str, str]) -> str:
    """The report; names is object by serial."""
    sizes = " x ".join(f"{100 * value:.0f}" for value in found.extent_m.tolist())
    held_out, fitted = found.held_out, found.residual
    lines = [
        (
            f"registered {', '.join(names[serial] for serial in found.trackers)}: the lighthouses' "
            "frame in the rig"
        ),
        (
            f"  in the middle of the volume   {1e3 * found.sigma_m:.2f} mm and "
            f"{np.degrees(found.sigma_rad):.3f} deg (one standard deviation)"
        ),
        (
            f"  held-out seconds              {held_out.mm:.2f} mm, {held_out.px:.2f} px "
            f"an axis (in the fit {fitted.mm:.2f} mm, {fitted.px:.2f} px)"
        ),
        (
            f"  from                          {found.seconds:.0f} s over {sizes} cm; "
            f"{found.inliers} sightings, {found.rejected} left out, {found.rejected_poses} poses "
            "left out"
        ),
        f"  at the volume's ends          {1e3 * _far_sigma_m(found):.2f} mm",
    ]
    for serial, tracker in found.trackers.items():
        lines.append(f"  {names[serial]} ({serial}): {_tracker(tracker)}")
    if found.universe:
        lines.append(f"  universe {found.universe}")
    return "\n".join(lines)


def points_text(found: PointRegistration, name: str) -> str:
    """The report of a registration from points measured by other means."""
    worst = 1e3 * float(np.linalg.norm(found.residuals_m, axis=1).max())
    lever = ", ".join(f"{1e3 * value:.1f}" for value in found.marker_m.tolist())
    return (
        f"registered {name} from {len(found.residuals_m)} points: {1e3 * found.rms_m:.2f} mm RMS "
        f"are left, {worst:.2f} at most; the point is at ({lever}) mm on the tracker"
    )


def _tracker(tracker: TrackerPlace) -> str:
    x, y, z = (1e3 * tracker.marker_m).tolist()
    sigma = 1e3 * float(np.linalg.norm(tracker.marker_sigma_m))
    late = 1e-6 * tracker.time_offset_ns
    late_sigma = 1e-6 * tracker.time_offset_sigma_ns
    when = "late" if late >= 0.0 else "early"
    return (
        f"paint at ({x:.1f}, {y:.1f}, {z:.1f}) mm on the tracker, +- {sigma:.1f}; its stamps are "
        f"{abs(late):.1f} ms {when}, +- {late_sigma:.1f}"
    )


def _far_sigma_m(found: ObjectRegistration) -> float:
    """Standard deviation half the volume's extents away from its middle."""
    return float(np.hypot(found.sigma_m, found.sigma_rad * 0.5 * np.linalg.norm(found.extent_m)))
