"""What is still missing while somebody moves the tracker: plain sentences, live. Pure."""

from __future__ import annotations

import numpy as np

from services.calibrator.objects.coverage import (
    MIN_SECOND_M,
    MIN_SECONDS,
    MIN_THIRD_M,
    MIN_TURN_RAD,
    coverage,
)
from services.calibrator.objects.sightings import Sightings
from services.calibrator.objects.start import instants_in_two_views
from services.calibrator.objects.tracker_path import TrackerPath

# A registration gains from more than the least: this many times as much is asked for live.
_AMPLE = 2.0
# Of the instants asked for, so many are enough to tell; more cost time at every look.
_MAX_INSTANTS = 400


def motion_still_missing(seen: Sightings, path: TrackerPath) -> list[str]:
    """What a person should do next, most urgent first; empty when there is enough.

    Cheap enough for once a second: nothing is solved, the stamps of tracker and cameras are taken
    to agree to some tenths of a second.
    """
    if not len(seen):
        return [f"no camera sees the {seen.color} paint: turn the dab to the cameras"]
    counts = np.bincount(seen.camera, minlength=len(seen.cameras))
    blind = [c.name for c, n in zip(seen.cameras, counts.tolist(), strict=True) if not n]
    if len(seen.cameras) - len(blind) < 2:
        return [
            f"camera {', '.join(blind)} does not see the {seen.color} paint: go where both see it"
        ]
    if not len(path):
        return [f"tracker {path.serial} is not tracked: let the base stations see it"]
    stamps_ns = instants_in_two_views(seen)
    step = max(1, len(stamps_ns) // _MAX_INSTANTS)
    motion = path.motion(stamps_ns[::step])
    known = motion.known
    covered = coverage(stamps_ns[::step][known], motion.position_m[known], motion.rotation[known])
    missing = []
    if covered.seconds < _AMPLE * MIN_SECONDS:
        left = _AMPLE * MIN_SECONDS - covered.seconds
        missing.append(f"{left:.0f} s more in sight of two cameras and the base stations")
    if covered.turn_rad < _AMPLE * MIN_TURN_RAD:
        missing.append("turn the tracker more: tilt it forwards and back, and to both sides")
    if covered.extent_m[1] < _AMPLE * MIN_SECOND_M:
        missing.append("move the tracker farther: left and right, and up and down")
    elif covered.extent_m[2] < _AMPLE * MIN_THIRD_M:
        missing.append(_third_direction(seen, covered.extent_m))
    return missing


def _third_direction(seen: Sightings, extent_m: np.ndarray) -> str:
    """Which direction is short: in the picture one can tell up and down from depth."""
    first = seen.camera == np.bincount(seen.camera).argmax()
    width, height = (np.ptp(np.quantile(seen.rays[first], (0.05, 0.95), axis=0), axis=0)).tolist()
    said = f"({100 * extent_m[2]:.0f} cm so far)"
    if height < 0.5 * width:
        return f"move the tracker up and down more {said}"
    if width < 0.5 * height:
        return f"move the tracker left and right more {said}"
    return f"move the tracker nearer to the cameras and farther away {said}"
