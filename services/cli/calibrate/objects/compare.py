"""`rhot calibrate objects --check`: how far paint and trackers disagree now, with the registration
that there is. Changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import Objects
from rhot.geometry.camera import Camera
from services.calibrator.objects.recorded import Recorded
from services.calibrator.objects.wanted import Painted

if TYPE_CHECKING:
    from services.object_tracker.monitors.drift_fit import DriftSamples

# As the watch of the object tracker: less does no harm.
_HARMLESS_M = 0.003
_SIGNIFICANT = 5.0
_LEAST = 60


class Disagreement(msgspec.Struct, frozen=True, kw_only=True):
    """Of one object: how far its paint is from where its pose puts it.

    shift_mm is along the rig's axes; significance in standard deviations; scatter_px what is left
    around the shift; universe is the poses' where it is another than the registration's, else "".
    """

    object: str
    distance_mm: float
    shift_mm: tuple[float, float, float]
    turn_deg: float
    significance: float
    scatter_px: float
    sightings: int
    universe: str = ""

    @property
    def fits(self) -> bool:
        """Whether the registration may stay as it is."""
        apart = self.distance_mm >= 1e3 * _HARMLESS_M and self.significance >= _SIGNIFICANT
        return not apart and not self.universe

    def text(self) -> str:
        """In one sentence or two."""
        shift = ", ".join(f"{value:+.1f}" for value in self.shift_mm)
        what = (
            f"{self.object}: paint and tracker disagree by {self.distance_mm:.1f} mm ({shift} mm "
            f"along x, y, z of the rig; {self.turn_deg:.2f} deg), from {self.sightings} sightings "
            f"that scatter by {self.scatter_px:.2f} px"
        )
        if self.universe:
            return f"{what}. The poses are of universe {self.universe}: register again"
        return f"{what}. " + ("That is well." if self.fits else "Register again.")


def disagreements(
    recorded: Recorded, cameras: Mapping[str, Camera], painted: list[Painted], objects: Objects
) -> list[Disagreement]:
    """Each object's.

    Raises CalibrationError if one was never registered by its paint, or is not seen enough.
    """
    found = []
    for one in painted:
        samples = _samples(recorded, cameras, one, objects)
        found.append(_compared(one, samples, tuple(cameras.values()), recorded, objects))
    return found


def _samples(
    recorded: Recorded, cameras: Mapping[str, Camera], one: Painted, objects: Objects
) -> DriftSamples:
    from services.object_tracker.monitors.drift_fit import DriftSamples

    place = objects.objects.get(one.name)
    if place is None or place.marker_m is None:
        raise CalibrationError(
            f"objects.json does not know where the paint is on {one.name}'s tracker: run "
            "`rhot calibrate objects` first"
        )
    seen = recorded.sightings(cameras, [one])[one.serial]
    path = recorded.paths().get(one.serial)
    if path is None:
        heard = ", ".join(sorted(recorded.poses)) or "none at all"
        raise CalibrationError(f"no poses of {one.serial}; heard: {heard}")
    motion = path.motion(seen.stamps_ns, 1e-9 * place.time_offset_ns)
    seen, motion = seen.only(motion.known), motion.only(motion.known)
    if len(seen) < _LEAST:
        raise CalibrationError(
            f"{one.name}: the {one.color} paint and the tracker were seen together {len(seen)} "
            f"times only, {_LEAST} are needed: move it where two cameras and the base stations see "
            "it"
        )
    T = np.array(objects.T_rig_from_lighthouse)
    p_lighthouse = motion.position_m + motion.rotation @ np.array(place.marker_m)
    return DriftSamples(
        p_rig=p_lighthouse @ T[:3, :3].T + T[:3, 3],
        R_rig_from_object=T[:3, :3] @ motion.rotation,
        camera=seen.camera,
        pixels=seen.pixels,
    )


def _compared(
    one: Painted,
    samples: DriftSamples,
    cameras: tuple[Camera, ...],
    recorded: Recorded,
    objects: Objects,
) -> Disagreement:
    from services.object_tracker.monitors.drift_fit import fit_drift

    fit = fit_drift(samples, cameras)
    if fit is None:
        raise CalibrationError(
            f"{one.name}: the {one.color} paint does not move as its tracker does: is it on "
            f"{one.serial}, and is no other thing of that colour in view? If so, the registration "
            "is far off: run `rhot calibrate objects`"
        )
    universe = recorded.poses[one.serial][-1].universe
    x, y, z = (round(1e3 * value, 2) for value in fit.shift_m.tolist())
    return Disagreement(
        object=one.name,
        distance_mm=round(1e3 * fit.distance_m, 2),
        shift_mm=(x, y, z),
        turn_deg=round(float(np.degrees(np.linalg.norm(fit.turn_rad))), 3),
        significance=round(fit.significance((objects.sigma_m or 0.0) / 3**0.5), 1),
        scatter_px=round(fit.scale_px, 3),
        sightings=len(samples.p_rig),
        universe=universe if objects.universe and universe != objects.universe else "",
    )
