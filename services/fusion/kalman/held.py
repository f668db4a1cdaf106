"""What a hand's filter holds, as kernels are handed it (rhot.kernels.packed)."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Packed
from services.fusion.arrays import Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.filtering import complete_newest, filter_from
from services.fusion.kalman.frame_update import Fates, FrameLooks, Sights, take_in
from services.fusion.kalman.history import HandHistory
from services.fusion.kalman.motion.motion_models import MotionModels
from services.fusion.kalman.telling import tell


class Held(NamedTuple):
    """All of one hand's filter."""

    history: HandHistory
    sights: Sights
    fates: Fates
    cameras: Extrinsics
    models: MotionModels
    gate: float


@njit(cache=True, error_model="numpy")
def take_looks(
    packed: Packed,
    camera: int,
    landmarks: Ints,
    times_s: Array,
    rays: Array,
    sigmas: Array,
    clock_variance: float,
) -> int:
    """frame_update.take_in of Held and the parts of FrameLooks."""
    held: Held = packed.parts
    looks = FrameLooks(camera, landmarks, times_s, rays, sigmas, clock_variance)
    filters = held.models, held.gate
    return take_in(held.history, held.sights, held.cameras, filters, looks, held.fates)


@njit(cache=True, error_model="numpy")
def complete(packed: Packed) -> None:
    """filtering.complete_newest of Held."""
    held: Held = packed.parts
    complete_newest(held.history, held.cameras, (held.models, held.gate))


@njit(cache=True, error_model="numpy")
def filter_again(packed: Packed, index: int) -> None:
    """filtering.filter_from of Held."""
    held: Held = packed.parts
    filter_from(held.history, index, held.cameras, (held.models, held.gate))


@njit(cache=True, error_model="numpy")
def tell_all(packed: Packed, told: Packed, time_s: float, recent_s: Array) -> tuple[int, int]:
    """telling.tell of Held and Estimates."""
    held: Held = packed.parts
    filters = held.models, held.gate
    return tell(held.history, held.sights, held.cameras, filters, time_s, recent_s, told.parts)
