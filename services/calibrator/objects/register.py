"""Registration of the lighthouses' frame to the rig's from paint on moved trackers. Pure.

`rhot calibrate objects`. Cameras and lighthouses see the same tracker at the same time: its path is
known in the lighthouses' frame, its paint in the cameras' pictures. T_rig_from_lighthouse, where
the paint is on the tracker, and how late the tracker's stamps are, come from one bundle in pixels
(solve.py), started from a search that needs no guess (start.py). Several trackers, or a tracker on
the wrist whose paint is the hand's own, are the same problem. What cannot determine the answer is
refused, with the reason and what to do (checks.py).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.objects.bundle.held_out import held_out, residuals_of
from services.calibrator.objects.bundle.reprojection import (
    POSE_SIZE,
    TRACKER_SIZE,
    Scene,
    Unknowns,
    scene,
)
from services.calibrator.objects.bundle.solve import Sampler, Solution, middle_of, solve
from services.calibrator.objects.checks import (
    check_result,
    check_sightings,
    check_start,
)
from services.calibrator.objects.coverage import extents
from services.calibrator.objects.result import ObjectRegistration, TrackerPlace
from services.calibrator.objects.sightings import Sightings
from services.calibrator.objects.start import Located, Start, find_start, locate
from services.calibrator.objects.tracker_path import TrackerPath

# Poses sampled for a lateness serve for another so near, s: at 20 m/s^2 the error is .1 um.
_SAME_LATE_S = 1e-4


def register(seen: Mapping[str, Sightings], paths: Mapping[str, TrackerPath]) -> ObjectRegistration:
    """The registration from what cameras saw of the paint of each tracker, by serial, and the paths
    of these trackers and of any others that were there.

    The others only serve to tell when the paint is on one of them. Raises CalibrationError, with
    the reason and what to do, where the recording cannot determine the registration.
    """
    check_sightings(seen, paths)
    serials = list(seen)
    located = {serial: locate(seen[serial]) for serial in serials}
    starts = {serial: find_start(located[serial], paths[serial]) for serial in serials}
    check_start(seen, paths, located, starts)
    own_paths = [paths[serial] for serial in serials]
    own_seen = [seen[serial] for serial in serials]

    sample = _sampler(own_seen, own_paths)
    found = solve(sample, _unknowns(starts, located))
    result = _registration(sample, found, serials, own_paths)
    check_result(result)
    return result


def _sampler(seen: list[Sightings], paths: list[TrackerPath]) -> Sampler:
    """The scene for any lateness; the one of before where that is nearly the same."""
    last: list[Scene] = []

    def sample(late_s: Array) -> Scene:
        if not last or float(np.abs(last[0].late_s - late_s).max()) > _SAME_LATE_S:
            motions = [
                path.motion(sightings.stamps_ns, float(late))
                for path, sightings, late in zip(paths, seen, late_s, strict=True)
            ]
            last[:] = [scene(seen, motions, late_s)]
        return last[0]

    return sample


def _unknowns(starts: Mapping[str, Start | None], located: Mapping[str, Located]) -> Unknowns:
    """One start of all trackers: the frame of the one that was located most."""
    known = {serial: start for serial, start in starts.items() if start is not None}
    best = max(known, key=lambda serial: len(located[serial].stamps_ns))
    return Unknowns(
        known[best].T_rig_from_lighthouse,
        np.stack([start.marker_m for start in known.values()]),
        np.array([start.late_s for start in known.values()]),
    )


def _registration(
    sample: Sampler, found: Solution, serials: list[str], paths: list[TrackerPath]
) -> ObjectRegistration:
    inlier = found.inlier
    points = found.result.points[inlier]
    sigma = np.sqrt(np.maximum(np.diag(found.covariance), 0.0))
    trackers = {}
    for k, serial in enumerate(serials):
        own = sigma[POSE_SIZE + TRACKER_SIZE * k :][:TRACKER_SIZE]
        late_ns = round(float(found.unknowns.late_s[k]) * 1e9)
        trackers[serial] = TrackerPlace(
            found.unknowns.markers_m[k], own[:3], late_ns, round(float(own[3]) * 1e9)
        )
    return ObjectRegistration(
        T_rig_from_lighthouse=found.unknowns.T_rig_from_lighthouse,
        trackers=trackers,
        universe=paths[0].universe,
        covariance=found.covariance[:POSE_SIZE, :POSE_SIZE],
        middle_m=middle_of(found),
        sigma_m=float(np.linalg.norm(sigma[3:6])),
        sigma_rad=float(np.linalg.norm(sigma[:3])),
        residual=residuals_of(found),
        held_out=held_out(sample, found),
        inliers=int(inlier.sum()),
        rejected=int((~inlier).sum()),
        rejected_poses=sum(path.rejected for path in paths),
        seconds=float(np.ptp(found.scene.stamps_s)),
        extent_m=extents(points),
        noise=found.noise,
    )
