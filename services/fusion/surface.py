"""From the visible centre of paint to the point on the bone axis that stands for the landmark.

Cameras see paint on skin, but what is triangulated is not a point of the skin. The centroid of a painted finger tip is set by its
outline. Where the outline is the limb of the finger, it passes through the axis as seen from any camera, so two cameras put the
centroid *on the axis*; only the edge where the paint ends lies on the skin itself. Ray-cast from two cameras 75 mm apart (capsule
r 6.8 mm painted over 14 mm; 400 random directions, the finger not pointing away), the triangulated centroid against the middle of
the painted axis:

    along the viewing ray   -.5 +- 2.0 mm (towards the cameras; the same within .1 mm at .35, .5 and .8 m, and with shading)
    across it               1.5 mm RMS
    finger along the baseline -2.4 mm, across it -.1 mm, pointing at the cameras +2.1 mm

A push by the whole radius would be 6.3 mm wrong. So a point is pushed MEAN_PUSH radii away from the cameras, and what the unknown
direction of the finger leaves goes into the covariance. Dabs (radius 0) are flat and lie where they are seen.
"""

from __future__ import annotations

import numpy as np

from rhot.transforms import Array

# In radii of the paint, from the ray-casting above: .5 mm of 6.8 mm, and what is left along the ray and along each axis across it.
MEAN_PUSH = 0.08
SIGMA_ALONG = 0.29
SIGMA_ACROSS = 0.16


def to_axis(positions_m: Array, covariances_m2: Array, radii_m: Array, eye_rig: Array) -> tuple[Array, Array]:
    """Points on the bone axis (n, 3) and their covariances (n, 3, 3) from triangulated paint centres, rig frame.

    radii_m (n,) are the paints' radii, eye_rig (3,) the middle of the cameras' optical centres: the mean viewing ray starts there.
    """
    away = positions_m - eye_rig
    away = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)  # (n, 3)
    along = away[:, :, None] * away[:, None, :]  # (n, 3, 3)
    across = np.eye(3) - along
    radii = radii_m[:, None]
    blur = radii[:, :, None] ** 2 * (SIGMA_ALONG**2 * along + SIGMA_ACROSS**2 * across)
    return positions_m + MEAN_PUSH * radii * away, covariances_m2 + blur
