"""What a hand's filter holds, as kernels are handed it: in one row of plain arrays.

An array in a tuple costs a call from Python .1 us more than one by itself, and a filter holds 47.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.frame_update import Fates, FrameLooks, Sights, take_in
from services.fusion.kalman.history import HandHistory
from services.fusion.kalman.motion_models import MotionModels
from services.fusion.kalman.telling import tell
from services.fusion.method import Estimates


class Held(NamedTuple):
    """All of one hand's filter."""

    history: HandHistory
    sights: Sights
    fates: Fates
    cameras: Extrinsics
    models: MotionModels
    gate: float


# How many there are of what is handed over beside it, and where each part ends in a row.
_LOOKS, _ESTIMATES = len(FrameLooks._fields), len(Estimates._fields)
_HISTORY = len(HandHistory._fields)
_SIGHTS = _HISTORY + len(Sights._fields)
_FATES = _SIGHTS + len(Fates._fields)
_CAMERAS = _FATES + len(Extrinsics._fields)
_MODELS = _CAMERAS + len(MotionModels._fields)


def in_a_row(held: Held) -> tuple[Any, ...]:
    """Every array and number, one after the other."""
    *parts, gate = held
    return (*(item for part in parts for item in part), gate)


@njit(cache=True)
def _held_of(row: tuple[Any, ...]) -> Held:
    """The inverse of in_a_row."""
    return Held(
        HandHistory(*row[:_HISTORY]),
        Sights(*row[_HISTORY:_SIGHTS]),
        Fates(*row[_SIGHTS:_FATES]),
        Extrinsics(*row[_FATES:_CAMERAS]),
        MotionModels(*row[_CAMERAS:_MODELS]),
        row[_MODELS],
    )


@njit(cache=True, error_model="numpy")
def take_looks(*row: Any) -> int:
    """frame_update.take_in of FrameLooks and Held, one after the other."""
    looks, held = FrameLooks(*row[:_LOOKS]), _held_of(row[_LOOKS:])
    filters = held.models, held.gate
    return take_in(held.history, held.sights, held.cameras, filters, looks, held.fates)


@njit(cache=True, error_model="numpy")
def tell_all(time_s: float, recent_s: Array, *row: Any) -> tuple[int, int]:
    """telling.tell of Estimates and Held, one after the other."""
    told, held = Estimates(*row[:_ESTIMATES]), _held_of(row[_ESTIMATES:])
    filters = held.models, held.gate
    return tell(held.history, held.sights, held.cameras, filters, time_s, recent_s, told)
