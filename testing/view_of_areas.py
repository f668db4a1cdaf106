"""A camera's look at landmarks of which nothing but the areas counts."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.intake.observations import View


def view_of_areas(camera: int, areas: Array) -> View:
    """Landmarks 0 to n - 1 in the middle of a picture; areas (n,) in the rays' units."""
    n = len(areas)
    return View(
        camera=camera,
        instant_ns=0,
        landmarks=np.arange(n),
        delay_s=np.zeros(n),
        rays=np.zeros((n, 2)),
        sigmas=np.full(n, 2e-4),
        areas=areas,
        cut=np.zeros(n, dtype=np.bool_),
        clock_offset_ns=0,
        clock_sigma_s=0.0,
        ignored=0,
    )
