"""The reference that anyone would think of: a cubic spline through each camera's markers, looked at
afterwards, and the rays of all cameras at the wanted instant triangulated. Pure.

It is not causal: it knows the frames after the instant. Stamps are taken as announced.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from testing.families.case import Case
from testing.synthetic_points import START_NS

# Markers further apart than this many periods have no spline between them: a frame is lost now and
# then, but what lies in a longer gap nobody saw.
_MAX_GAP = 3.5


def spline_bound(case: Case, instants_s: Array) -> Array:
    """Landmarks (n, L, 3) at n instants, NaN where fewer than two cameras' splines reach."""
    landmarks, hand = case.landmarks, case.config.hand[case.hand]
    # Of each camera and landmark: rays' origin (3,) and directions (n, 3), NaN outside.
    centres = np.stack([camera.centre_rig for camera in case.cameras.values()])
    rays = np.stack(
        [
            np.stack(
                [_rays(case, camera, hand.markers[landmark], instants_s) for landmark in landmarks],
                axis=1,
            )
            for camera in case.cameras.values()
        ]
    )  # (C, n, L, 3)
    return _meeting_points(centres, rays)


def _rays(case: Case, camera: Camera, color: str, instants_s: Array) -> Array:
    """Unit directions (n, 3) in the rig frame in which a camera sees a colour; NaN in gaps."""
    found = []
    for frame in case.frames:
        if frame.camera != camera.name:
            continue
        begin_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
        found += [
            (begin_s + marker.y_px * frame.row_time_ns * 1e-9, marker.x_px, marker.y_px)
            for marker in frame.markers
            if marker.color == color
        ]
    directions = np.full((len(instants_s), 3), np.nan)
    if len(found) < 4:
        return directions
    table = np.array(found)[np.argsort([row[0] for row in found], kind="stable")]
    times_s, image = table[:, 0], camera.rays_from_pixels(table[:, 1:])
    good = np.isfinite(image).all(axis=1) & np.concatenate([[True], np.diff(times_s) > 1e-4])
    times_s, image = times_s[good], image[good]
    after = np.searchsorted(times_s, instants_s)
    inside = (after > 0) & (after < len(times_s))
    gaps_s = times_s[np.clip(after, 1, len(times_s) - 1)] - times_s[np.clip(after - 1, 0, None)]
    inside &= gaps_s < _MAX_GAP / case.config.camera_named(camera.name).fps
    flat = CubicSpline(times_s, image, axis=0)(instants_s[inside])
    local = np.column_stack([flat, np.ones(len(flat))])
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    directions[inside] = local @ camera.T_rig_from_camera[:3, :3].T
    return directions


def _meeting_points(centres: Array, rays: Array) -> Array:
    """Where rays (C, n, L, 3) from centres (C, 3) come nearest to each other; (n, L, 3)."""
    known = np.isfinite(rays).all(axis=3)  # (C, n, L)
    across = np.eye(3) - rays[..., :, None] * rays[..., None, :]  # (C, n, L, 3, 3)
    across = np.where(known[..., None, None], across, 0.0)
    normal = across.sum(axis=0)
    right = np.einsum("cnlij,cj->nli", across, centres)
    enough = known.sum(axis=0) >= 2
    points = np.full(right.shape, np.nan)
    points[enough] = np.linalg.solve(normal[enough], right[enough][..., None])[..., 0]
    return points
