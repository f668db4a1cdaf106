"""One camera's observations of one frame, as arrays for the compiled filter."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints


class FrameRays(NamedTuple):
    """A frame's n observations, each of another landmark and at its own instant."""

    camera: int
    landmarks: Ints  # (n,)
    times_s: Array  # (n,)
    rays: Array  # (n, 2) undistorted x/z, y/z
    sigmas: Array  # (n,) of each ray coordinate
    clock_sigma_s: float


class Observation(NamedTuple):
    """One camera's ray of one landmark, at its own instant."""

    time_s: float
    camera: int
    ray: Array  # (2,) undistorted x/z, y/z
    ray_variance: float  # of each ray coordinate
    clock_variance: float  # of the camera's clock, s^2


@njit(cache=True)
def observation(frame: FrameRays, n: int) -> Observation:
    """The n-th observation of a frame."""
    return Observation(
        frame.times_s[n],
        frame.camera,
        frame.rays[n],
        frame.sigmas[n] ** 2,
        frame.clock_sigma_s**2,
    )
