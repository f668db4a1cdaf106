"""What a tracker's motion covers: time, volume and turns while cameras saw its paint. Pure.

None of it needs the registration: a rigid motion covers as much in the lighthouses' frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.objects.sightings import Ints

# What a registration takes. Of 20 s of motion over half a metre, 1 mm and 0.2 deg of a tracker's
# noise and 0.3 px leave 0.3 mm; a third of that time leaves twice as much.
MIN_SECONDS, MIN_INSTANTS = 8.0, 120
# Extents of the motion along its second and third main direction, m: less is a line, or a plane.
MIN_SECOND_M, MIN_THIRD_M = 0.10, 0.06
# RMS of the turn about the second of the tracker's axes, rad. Turned about one axis only, the
# paint may sit anywhere along that axis, and the lighthouse with it.
MIN_TURN_RAD = 0.12
# Time is counted in slots of this, s: one located point each is enough.
_SLOT_S = 0.2


class Coverage(NamedTuple):
    """Seconds and instants at which the paint was located and the tracker tracked; the extents of
    the motion along its main directions, largest first; the turn about the axis it turned about
    second most.
    """

    seconds: float
    instants: int
    extent_m: Array  # (3,)
    turn_rad: float


def coverage(stamps_ns: Ints, positions_m: Array, rotations: Array) -> Coverage:
    """Of n instants (n,) ns with positions (n, 3) and rotations (n, 3, 3) of the tracker."""
    if len(stamps_ns) < 3:
        return Coverage(0.0, len(stamps_ns), np.zeros(3), 0.0)
    slots = np.unique((stamps_ns - stamps_ns[0]) // int(_SLOT_S * 1e9))
    return Coverage(
        len(slots) * _SLOT_S, len(stamps_ns), extents(positions_m), second_turn(rotations)
    )


def extents(points: Array) -> Array:
    """How far points (n, 3) reach along their main directions, but for 2 % at each end; (3,)."""
    centred = points - np.median(points, axis=0)
    # Outliers must not turn the directions: those beyond three times the median distance are few.
    distance = np.linalg.norm(centred, axis=1)
    centred = centred[distance <= 3.0 * max(float(np.median(distance)), 1e-9)]
    _, _, directions = np.linalg.svd(centred, full_matrices=False)
    low, high = np.quantile(centred @ directions.T, (0.02, 0.98), axis=0)
    return np.asarray(np.sort(high - low)[::-1])


def second_turn(rotations: Array) -> float:
    """RMS angle, rad, by which the worst known direction e of the tracker's frame was turned.

    |(R - mean R) e| over rotations (n, 3, 3) is how much a lever arm along e shows; for turns about
    a single axis the least is 0, along that axis.
    """
    scattered = rotations - rotations.mean(axis=0)
    shown = np.einsum("nki,nkj->ij", scattered, scattered) / len(rotations)
    return float(np.sqrt(max(np.linalg.eigvalsh(shown)[0], 0.0)))
