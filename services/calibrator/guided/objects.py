"""Trackers registered to the rig, judged and told in plain words. Pure."""

from __future__ import annotations

import numpy as np

from rhot.files.calibration import Objects
from services.calibrator.guided.found import Found, figure
from services.calibrator.objects.result import ObjectRegistration

# In the middle of the volume, one standard deviation, m: an object that is further off than this is
# touched by fingers that are beside it.
_SIGMA_M = 2e-3
# Of seconds that took no part in the fit, mm an axis: the simulated sweep of
# docs/guide/register-objects.md leaves .66 mm; five times that is no longer noise.
_HELD_OUT_MM = 3.3


def objects_found(made: Objects, found: ObjectRegistration, names: list[str]) -> Found:
    """What the page says of a registration of these objects."""
    good = found.sigma_m <= _SIGMA_M and found.held_out.mm <= _HELD_OUT_MM
    far_m = float(
        np.hypot(found.sigma_m, found.sigma_rad * 0.5 * float(np.linalg.norm(found.extent_m)))
    )
    advice = []
    if not good:
        advice.append(
            "Do it again: slower, farther to all sides, and with the paint towards both cameras. "
            "See that base stations and cameras stand firmly."
        )
    return Found(
        files={"objects.json": made},
        good=good,
        figures=[
            figure("registered", ", ".join(names)),
            figure("error of seconds that were left out", f"{found.held_out.mm:.2f} mm"),
            figure("certain in the middle to", f"± {1e3 * found.sigma_m:.2f} mm"),
            figure("certain at the ends to", f"± {1e3 * far_m:.2f} mm"),
            figure("seen for", f"{found.seconds:.0f} s"),
        ],
        advice=advice,
    )
