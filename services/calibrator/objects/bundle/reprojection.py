"""Reprojection of paint on trackers into cameras, with derivatives by all unknowns. Pure.

One sighting: the ray z of camera k at its own instant s. With the pose (Q, p) of its tracker at
s + late, paint at m in the tracker's frame, and T_rig_from_lighthouse = (R, t),

    q = Q m + p,    x = R (q - q0) + c,    r = f (z - project(T_k x)),    c = R q0 + t

in pixels. q0 is the middle of the motion, about which R turns: so that shift and turn are nearly
independent, and the covariance is that at the middle of the volume. Unknowns are a turn (3) and a
shift (3) in the rig frame, and for each tracker m (3) and late (1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhot.geometry.transforms import Array, inverse, rotation_from_vector, transform
from services.calibrator.objects.path_fit import Motion
from services.calibrator.objects.points import cross_matrices
from services.calibrator.objects.sightings import Bools, Sightings

# Of the turn and shift together, and of each tracker's marker and lateness.
POSE_SIZE, TRACKER_SIZE = 6, 4
# Paint nearer to a camera's plane than this, m, is a start gone wrong.
_MIN_DEPTH_M = 0.02


@dataclass(frozen=True, eq=False)
class Unknowns:
    """T_rig_from_lighthouse, and of K trackers the paint and how late their stamps are."""

    T_rig_from_lighthouse: Array  # (4, 4)
    markers_m: Array  # (K, 3)
    late_s: Array  # (K,)

    def stepped(self, step: Array, middle: Array) -> Unknowns:
        """After a step (6 + 4 K,); middle (3,) is q0 in the lighthouses' frame."""
        T = self.T_rig_from_lighthouse
        R = rotation_from_vector(step[:3]) @ T[:3, :3]
        centre = T[:3, :3] @ middle + T[:3, 3] + step[3:6]
        own = step[POSE_SIZE:].reshape(-1, TRACKER_SIZE)
        return Unknowns(
            transform(R, centre - R @ middle), self.markers_m + own[:, :3], self.late_s + own[:, 3]
        )


@dataclass(frozen=True, eq=False)
class Scene:
    """Sightings (n) of all trackers with the trackers' motion at them, sampled for late_s (K,)."""

    tracker: Array  # (n,) int, index
    rays: Array  # (n, 2)
    sigma_px: Array  # (n,)
    area_px: Array  # (n,) of the paint, as it is seen
    stamps_s: Array  # (n,)
    focals_px: Array  # (n,)
    R_camera_from_rig: Array  # (n, 3, 3)
    t_camera_from_rig: Array  # (n, 3)
    motion: Motion
    late_s: Array  # (K,)

    def only(self, wanted: Bools) -> Scene:
        """Those sightings."""
        names = ("tracker", "rays", "sigma_px", "area_px", "stamps_s", "focals_px")
        places = ("R_camera_from_rig", "t_camera_from_rig")
        some = {name: getattr(self, name)[wanted] for name in (*names, *places)}
        return replace(self, motion=self.motion.only(wanted), **some)


@dataclass(frozen=True, eq=False)
class Reprojection:
    """Residuals r of n sightings, their derivatives, and the depth of the paint."""

    residual_px: Array  # (n, 2)
    jacobian: Array  # (n, 2, 6 + 4 K): of the prediction, so r falls along it
    by_point: Array  # (n, 2, 3), px/m: of the prediction by the paint in the rig frame
    depth_m: Array  # (n,)
    points: Array  # (n, 3), rig frame

    def only(self, wanted: Bools) -> Reprojection:
        """Those sightings."""
        return Reprojection(
            self.residual_px[wanted],
            self.jacobian[wanted],
            self.by_point[wanted],
            self.depth_m[wanted],
            self.points[wanted],
        )


def scene(all_seen: Sequence[Sightings], motions: Sequence[Motion], late_s: Array) -> Scene:
    """The sightings whose tracker's motion is known, one entry of each list a tracker."""
    begin_ns = min(int(seen.stamps_ns[0]) for seen in all_seen)
    T = np.concatenate([_cameras_from_rig(seen)[seen.camera] for seen in all_seen])  # (n, 4, 4)
    joined = Scene(
        tracker=np.concatenate([np.full(len(seen), k) for k, seen in enumerate(all_seen)]),
        rays=np.concatenate([seen.rays for seen in all_seen]),
        sigma_px=np.concatenate([seen.sigma_px for seen in all_seen]),
        area_px=np.concatenate([seen.area_px for seen in all_seen]),
        stamps_s=np.concatenate([seen.seconds_from(begin_ns) for seen in all_seen]),
        focals_px=np.concatenate([seen.focals_px for seen in all_seen]),
        R_camera_from_rig=T[:, :3, :3],
        t_camera_from_rig=T[:, :3, 3],
        motion=Motion(*(np.concatenate(parts) for parts in zip(*motions, strict=True))),
        late_s=np.asarray(late_s, dtype=np.float64),
    )
    return joined.only(joined.motion.known)


def _cameras_from_rig(seen: Sightings) -> Array:
    """T_camera_from_rig of every camera; (C, 4, 4)."""
    return np.stack([inverse(camera.T_rig_from_camera) for camera in seen.cameras])


def reproject(at: Scene, unknowns: Unknowns, middle: Array) -> Reprojection:
    """All residuals and derivatives; middle (3,) is q0 in the lighthouses' frame.

    Lateness other than the scene's own moves the tracker along its velocity.
    """
    R, t = unknowns.T_rig_from_lighthouse[:3, :3], unknowns.T_rig_from_lighthouse[:3, 3]
    motion = at.motion
    ahead_s = (unknowns.late_s - at.late_s)[at.tracker]
    rates = cross_matrices(motion.angular_velocity_rad_s)
    rotation = motion.rotation + ahead_s[:, None, None] * (rates @ motion.rotation)
    lever = np.einsum("nij,nj->ni", motion.rotation, unknowns.markers_m[at.tracker])
    velocity = motion.velocity_m_s + np.einsum("nij,nj->ni", rates, lever)
    q = motion.position_m + lever + velocity * ahead_s[:, None]
    turned = (q - middle) @ R.T
    x = turned + R @ middle + t
    p_camera = np.einsum("nij,nj->ni", at.R_camera_from_rig, x) + at.t_camera_from_rig
    depth = np.maximum(p_camera[:, 2], _MIN_DEPTH_M)
    ray = p_camera[:, :2] / depth[:, None]
    by_point = np.zeros((len(x), 2, 3))
    by_point[:, 0, 0] = by_point[:, 1, 1] = 1.0 / depth
    by_point[:, :, 2] = -ray / depth[:, None]
    by_point = at.focals_px[:, None, None] * by_point @ at.R_camera_from_rig  # (n, 2, 3)
    J = np.zeros((len(x), 2, POSE_SIZE + TRACKER_SIZE * len(unknowns.markers_m)))
    J[:, :, :3] = -by_point @ cross_matrices(turned)
    J[:, :, 3:POSE_SIZE] = by_point
    by_lighthouse = by_point @ R
    for k in range(len(unknowns.markers_m)):
        own = at.tracker == k
        first = POSE_SIZE + TRACKER_SIZE * k
        J[own, :, first : first + 3] = by_lighthouse[own] @ rotation[own]
        J[own, :, first + 3] = np.einsum("nij,nj->ni", by_lighthouse[own], velocity[own])
    return Reprojection((at.rays - ray) * at.focals_px[:, None], J, by_point, depth, x)
