"""A first guess of the registration: located paint, every time offset tried, linear fits. Pure.

Rays of the other cameras are interpolated to one camera's instants and triangulated; for time
offsets over half a second either way the closed form of points.py is fitted robustly, and the one
that leaves least is the start of the bundle. No guess of anything is needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.geometry.transforms import Array, apply
from rhot.geometry.triangulation import triangulate
from services.calibrator.objects.path_fit import Motion
from services.calibrator.objects.points import closed_form
from services.calibrator.objects.sightings import Bools, Ints, Sightings
from services.calibrator.objects.tracker_path import TrackerPath
from services.calibrator.recalibrate.track import Track

# Stamps are tried as late or early by up to this, s; computers that keep time by NTP agree to .05.
MAX_LATE_S = 0.5
# Steps of the two rounds, s: at .5 m/s a step of the first is 8 mm, and the bundle starts within
# half a step of the second.
_COARSE_S, _FINE_S = 0.016, 0.002
# Located points that take part: more gain nothing for a start.
_MAX_POINTS = 300
# A located point whose rays miss each other by more, px, or farther than this, m, is none.
_MAX_MISS_PX, _MAX_DISTANCE_M = 6.0, 6.0
# Views of two cameras that run freely lie so far apart at most, ns: two frames at 30 Hz.
_BESIDE_NS = 67_000_000
# The path is fitted once at these steps, s; between them it moves on along its velocities.
_GRID_S = 0.008
# Longer recordings than ten minutes are read from their beginning.
_MAX_GRID = 75_000
# Reweighting rounds of a linear fit.
_ROUNDS = 4


class Located(NamedTuple):
    """Where two cameras or more located the paint; k instants."""

    stamps_ns: Ints  # (k,)
    points: Array  # (k, 3), rig frame


class Start(NamedTuple):
    """The guess; miss_m is what it leaves in the median.

    late_s is by how much the tracker's stamps are late.
    """

    T_rig_from_lighthouse: Array  # (4, 4)
    marker_m: Array  # (3,)
    late_s: float
    miss_m: float


def locate(seen: Sightings) -> Located:
    """The paint, triangulated at the instants of whichever camera saw it most."""
    empty = Located(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    counts = np.bincount(seen.camera, minlength=len(seen.cameras))
    if np.sum(counts >= 5) < 2:
        return empty
    begin_ns = int(seen.stamps_ns[0])
    best = int(counts.argmax())
    stamps_ns = np.unique(seen.stamps_ns[seen.camera == best])
    at_s = (stamps_ns - begin_ns) * 1e-9
    rays = np.full((len(seen.cameras), len(at_s), 2), np.nan)
    for c in range(len(seen.cameras)):
        own = seen.camera == c
        times_s, first = np.unique(seen.seconds_from(begin_ns)[own], return_index=True)
        track = Track(times_s, seen.rays[own][first]).without_outliers()
        rays[c] = track.interpolate(at_s)
    return _triangulated(seen, stamps_ns, rays) or empty


def instants_in_two_views(seen: Sightings) -> Ints:
    """Instants (k,) ns of one camera's sightings beside which another camera has one too."""
    counts = np.bincount(seen.camera, minlength=len(seen.cameras))
    best = seen.camera == counts.argmax()
    own, others = seen.stamps_ns[best], seen.stamps_ns[~best]
    if not len(others):
        return own[:0]
    place = np.clip(np.searchsorted(others, own), 1, max(len(others) - 1, 1))
    near = np.minimum(
        np.abs(others[np.minimum(place, len(others) - 1)] - own), np.abs(others[place - 1] - own)
    )
    return np.asarray(own[near <= _BESIDE_NS])


def _triangulated(seen: Sightings, stamps_ns: Ints, rays: Array) -> Located | None:
    known: Bools = np.asarray(np.isfinite(rays).all(axis=2))
    use = known.sum(axis=0) >= 2
    if not use.any():
        return None
    known, rays, stamps_ns = known[:, use], np.nan_to_num(rays[:, use]), stamps_ns[use]
    T = np.stack([camera.T_camera_from_rig for camera in seen.cameras])
    focals = np.array([float(np.mean(camera.focal_px)) for camera in seen.cameras])
    points = triangulate(T, rays, known * focals[:, None])
    p_camera = np.einsum("cij,nj->cni", T[:, :3, :3], points) + T[:, None, :3, 3]
    depth = p_camera[..., 2]
    miss = (rays - p_camera[..., :2] / np.maximum(depth, 1e-3)[..., None]) * focals[:, None, None]
    wrong = (np.linalg.norm(miss, axis=2) > _MAX_MISS_PX) | (depth <= 0.0)
    wrong |= depth > _MAX_DISTANCE_M
    good = ~(wrong & known).any(axis=0)
    return Located(stamps_ns[good], points[good])


def find_start(located: Located, path: TrackerPath) -> Start | None:
    """The best guess; None if the tracker was hardly seen while the paint was."""
    if not len(located.stamps_ns) or not len(path):
        return None
    step = max(1, len(located.stamps_ns) // _MAX_POINTS)
    located = Located(located.stamps_ns[::step], located.points[::step])
    grid = _Grid(located, path)
    coarse = np.arange(-MAX_LATE_S, MAX_LATE_S + 1e-9, _COARSE_S)
    guesses = [_fit(located, grid, float(late_s)) for late_s in coarse]
    known = [guess for guess in guesses if guess is not None]
    if not known:
        return None
    best = min(known, key=lambda guess: guess.miss_m)
    fine = best.late_s + np.arange(-_COARSE_S, _COARSE_S + 1e-9, _FINE_S)
    again = [_fit(located, grid, float(late_s)) for late_s in fine]
    return min([best, *(g for g in again if g is not None)], key=lambda guess: guess.miss_m)


class _Grid:
    """The path at equal steps, from which its motion at many instants is cheap."""

    def __init__(self, located: Located, path: TrackerPath) -> None:
        reach_ns = int((MAX_LATE_S + 0.1) * 1e9)
        self._begin_ns = int(located.stamps_ns[0]) - reach_ns
        seconds = (int(located.stamps_ns[-1]) + reach_ns - self._begin_ns) * 1e-9
        steps = np.arange(min(int(seconds / _GRID_S) + 1, _MAX_GRID))
        stamps_ns = self._begin_ns + np.round(steps * _GRID_S * 1e9).astype(np.int64)
        self._motion = path.motion(stamps_ns)

    def motion(self, stamps_ns: Ints, late_s: float) -> Motion:
        """As TrackerPath.motion."""
        since_s = (stamps_ns - self._begin_ns) * 1e-9 + late_s
        nearest = np.clip(np.round(since_s / _GRID_S).astype(np.int64), 0, len(self._motion[0]) - 1)
        ahead_s = (since_s - nearest * _GRID_S)[:, None]
        at = self._motion.only(nearest)
        turn = Rotation.from_rotvec(at.angular_velocity_rad_s * ahead_s).as_matrix()
        return at._replace(
            position_m=at.position_m + at.velocity_m_s * ahead_s, rotation=turn @ at.rotation
        )


def _fit(located: Located, path: _Grid, late_s: float) -> Start | None:
    motion = path.motion(located.stamps_ns, late_s)
    if motion.known.sum() < max(12, len(motion.known) // 4):
        return None
    points, motion = located.points[motion.known], motion.only(motion.known)
    weight = np.ones(len(points))
    for _ in range(_ROUNDS):
        T, marker = closed_form(points, motion.position_m, motion.rotation, weight)
        miss = np.linalg.norm(apply(T, carried(motion, marker)) - points, axis=1)
        usual = max(float(np.median(miss)), 1e-6)
        # Farther points are located worse: their depth, by the square of the distance.
        weight = 1.0 / (1.0 + (miss / (2.0 * usual)) ** 2) / np.sum(points**2, axis=1) ** 2
    return Start(T, marker, late_s, usual)


def carried(motion: Motion, marker_m: Array) -> Array:
    """Where the tracker carries a point (3,) of its own frame, in the lighthouses'; (m, 3)."""
    return motion.position_m + motion.rotation @ marker_m
