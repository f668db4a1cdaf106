"""Whether one object's tracker and the paint on it are where they were to each other.

Pure. Sightings of the last seconds are compared with the registration once a second
(drift_fit.py). A difference is told when it is far beyond what noise, blobs' centres and the
registration leave open, and has lasted. Paint that is partly hidden, another blob of its colour and
a tracker that jumps are not drift: sightings that are too small are left out, what does not move as
one rigid frame is not judged, and what could as well be the paint itself must last longer. At rest,
only paint that stays exactly where and as it was while the pose changes is believed.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.object_tracker.monitors.drift_fit import DriftFit, DriftSamples, fit_drift

# Named within ten seconds: most of the window must be after the change, and three looks agree.
_WINDOW_S = 6.0
_LOOKS = 3
# How long a difference lasts that hidden paint would explain as well. A cup is held for less.
_LONG_S = 30.0
# Fewer sightings, or of fewer cameras, say nothing of depth.
_MIN_SAMPLES, _MIN_OF_CAMERA, _MIN_CAMERAS = 60, 15, 2
# A registration leaves .75 mm and finger tips are known to 2 mm: less does no harm.
_LEAST_M = 0.003
# In standard deviations, of three dimensions together. 5 in noise is once in 10^5 looks.
_LEAST_SIGNIFICANCE = 5.0
# It is over well below where it began, so that it does not flicker.
_OVER = 0.7
# Motion of the tracker about its mean that tells its paint from a blob that stays: m, and rad.
_MOTION_M, _MOTION_RAD = 0.01, 0.1
# Against four fifths of the sightings of this camera: half hidden paint is left out.
_LEAST_AREA = 0.75
# Sightings of a minute at 30 Hz.
_AREAS = 1800
# Paint at rest: its centre scatters by .05 to .2 px and its area by some percent.
_REST_PX, _REST_AREA = 0.5, 0.1
# 4 cameras at 60 Hz.
_MAX_SAMPLES = 1500
# More do not make the fit better, as what they share is larger than their scatter; 3 ms.
_MAX_FITTED = 180


@dataclass(frozen=True, eq=False)
class PaintSighting:
    """The paint in one camera's picture, and the tracker at that instant."""

    camera: int
    instant_s: float
    pixel: tuple[float, float]
    area_px: float
    p_rig: Array  # (3,) where the paint should be
    R_rig_from_object: Array  # (3, 3)


class Drift(NamedTuple):
    """How far paint and tracker disagree, and since when (the clock of the sightings)."""

    distance_m: float
    since_s: float
    # Whether only a motion of the lighthouses' frame, or of the cameras, explains it.
    of_frame: bool
    fit: DriftFit


class _Rest(NamedTuple):
    pixel: Array  # (2,)
    area_px: float


class DriftWatch:
    """The watch on one object.

    cameras are those that sightings number; sigma_m is the registration's own, along each axis.
    drift is what is wrong now; distance_m is the newest difference, drift or not, None while
    nothing can be said.
    """

    def __init__(self, cameras: tuple[Camera, ...], sigma_m: float = 0.0) -> None:
        self.drift: Drift | None = None
        self.distance_m: float | None = None
        self._cameras, self._sigma_m = cameras, sigma_m
        self._samples: deque[PaintSighting] = deque(maxlen=_MAX_SAMPLES)
        # Area at 1 m of each camera's sightings.
        self._areas: list[deque[float]] = [deque(maxlen=_AREAS) for _ in cameras]
        self._rest: dict[int, _Rest] = {}
        self._first_s: float | None = None
        self._apart, self._together, self._clear = 0, 0, 0

    def observe(self, sighting: PaintSighting) -> None:
        """Take a sighting; older ones than the newest are as welcome."""
        self._samples.append(sighting)
        self._areas[sighting.camera].append(self._area_at_1m(sighting))

    def look(self, now_s: float) -> None:
        """Judge the last seconds; about once a second."""
        fresh = [one for one in self._samples if -1.0 < now_s - one.instant_s <= _WINDOW_S]
        self._samples = deque(fresh, maxlen=_MAX_SAMPLES)
        used = self._whole(fresh)
        samples = self._samples_of(used)
        fit = fit_drift(samples, self._cameras) if samples else None
        self.distance_m = None if fit is None else fit.distance_m
        if fit is None:
            # What stands, stands; what was about to be told must be as clear again.
            self._clear = 0
            return
        apart = fit.distance_m >= _LEAST_M
        if apart and fit.significance(self._sigma_m) >= _LEAST_SIGNIFICANCE:
            self._count_apart(fit, used, now_s)
        elif fit.distance_m < _OVER * _LEAST_M or not self.drift:
            self._count_together(used)

    def _count_apart(self, fit: DriftFit, used: list[PaintSighting], now_s: float) -> None:
        unmoved = self._paint_unmoved(used)
        if not unmoved and not _moves(used):
            return
        self._together = 0
        self._apart += 1
        self._first_s = now_s if self._first_s is None else self._first_s
        clear = unmoved or fit.of_frame
        self._clear = self._clear + 1 if clear else 0
        lasting = self._apart >= _LOOKS and now_s - self._first_s >= _LONG_S
        if self.drift or self._clear >= _LOOKS or lasting:
            since_s = self.drift.since_s if self.drift else self._first_s
            self.drift = Drift(fit.distance_m, since_s, clear, fit)

    def _count_together(self, used: list[PaintSighting]) -> None:
        self._apart = self._clear = 0
        self._first_s = None
        self._together += 1
        self._rest = {} if _moves(used) else self._at_rest(used)
        if self._together >= _LOOKS:
            self.drift = None

    def _whole(self, fresh: list[PaintSighting]) -> list[PaintSighting]:
        """Those that are not partly hidden."""
        typical = [
            float(np.quantile(np.array(areas), 0.8)) if areas else 0.0 for areas in self._areas
        ]
        return [one for one in fresh if self._area_at_1m(one) >= _LEAST_AREA * typical[one.camera]]

    def _area_at_1m(self, sighting: PaintSighting) -> float:
        camera = self._cameras[sighting.camera]
        depth_m = (sighting.p_rig - camera.centre_rig) @ camera.T_rig_from_camera[:3, 2]
        return float(sighting.area_px * depth_m**2)

    def _samples_of(self, used: list[PaintSighting]) -> DriftSamples | None:
        # By camera: every second one of all could be those of one camera.
        used = sorted(used, key=lambda one: one.camera)
        count = min(len(used), _MAX_FITTED)
        used = [used[n] for n in np.linspace(0, len(used) - 1, count).astype(int)]
        index = np.array([one.camera for one in used], dtype=np.int64)
        seen = np.bincount(index, minlength=len(self._cameras)) >= _MIN_OF_CAMERA
        if len(used) < _MIN_SAMPLES or np.count_nonzero(seen) < _MIN_CAMERAS:
            return None
        return DriftSamples(
            p_rig=np.array([one.p_rig for one in used]),
            R_rig_from_object=np.array([one.R_rig_from_object for one in used]),
            camera=index,
            pixels=np.array([one.pixel for one in used]),
        )

    def _at_rest(self, used: list[PaintSighting]) -> dict[int, _Rest]:
        """By camera, the paint where it does not move in the picture."""
        found = {}
        for camera in {one.camera for one in used}:
            own = [one for one in used if one.camera == camera]
            pixels = np.array([one.pixel for one in own])  # (n, 2)
            if len(own) >= _MIN_OF_CAMERA and _spread(pixels).max() < _REST_PX:
                area_px = float(np.median([one.area_px for one in own]))
                found[camera] = _Rest(np.median(pixels, axis=0), area_px)
        return found

    def _paint_unmoved(self, used: list[PaintSighting]) -> bool:
        """Whether at least two cameras see the paint exactly as they did while all agreed."""
        now = self._at_rest(used)
        return len(now) >= _MIN_CAMERAS and all(
            camera in self._rest
            and np.abs(rest.pixel - self._rest[camera].pixel).max() < _REST_PX
            and abs(rest.area_px / self._rest[camera].area_px - 1.0) < _REST_AREA
            for camera, rest in now.items()
        )


def _moves(used: list[PaintSighting]) -> bool:
    """Whether the tracker was moved or turned enough to know its paint by its motion."""
    p = np.array([one.p_rig for one in used])  # (n, 3)
    R = np.array([one.R_rig_from_object for one in used]).reshape(-1, 9)
    turned = np.sqrt(0.5) * np.linalg.norm(_spread(R))
    return bool(np.linalg.norm(_spread(p)) >= _MOTION_M or turned >= _MOTION_RAD)


def _spread(values: Array) -> Array:
    """Standard deviation of each column (n, k), from the median: a few wild ones do not count."""
    return 1.4826 * np.median(np.abs(values - np.median(values, axis=0)), axis=0)
