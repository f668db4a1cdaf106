"""What a hand's filter holds, as kernels are handed it: by its address (rhot.kernels.packed)."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Layout
from services.fusion.arrays import Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.kalman.filtering import complete_newest, filter_from
from services.fusion.kalman.frame_update import Fates, FrameLooks, Sights, take_in
from services.fusion.kalman.history import HandHistory
from services.fusion.kalman.motion.motion_models import MotionModels
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


HELD, ESTIMATES = Layout(), Layout()
_held_at, _estimates_at = HELD.at, ESTIMATES.at


@njit(cache=True, error_model="numpy")
def take_looks(
    address: int,
    camera: int,
    landmarks: Ints,
    times_s: Array,
    rays: Array,
    sigmas: Array,
    clock_variance: float,
) -> int:
    """frame_update.take_in of Held and the parts of FrameLooks."""
    held: Held = _held_at(address)
    looks = FrameLooks(camera, landmarks, times_s, rays, sigmas, clock_variance)
    filters = held.models, held.gate
    return take_in(held.history, held.sights, held.cameras, filters, looks, held.fates)


@njit(cache=True, error_model="numpy")
def complete(address: int) -> None:
    """filtering.complete_newest of Held."""
    held: Held = _held_at(address)
    complete_newest(held.history, held.cameras, (held.models, held.gate))


@njit(cache=True, error_model="numpy")
def filter_again(address: int, index: int) -> None:
    """filtering.filter_from of Held."""
    held: Held = _held_at(address)
    filter_from(held.history, index, held.cameras, (held.models, held.gate))


@njit(cache=True, error_model="numpy")
def tell_all(address: int, told: int, time_s: float, recent_s: Array) -> tuple[int, int]:
    """telling.tell of Held, to Estimates at another address."""
    held: Held = _held_at(address)
    filters = held.models, held.gate
    to: Estimates = _estimates_at(told)
    return tell(held.history, held.sights, held.cameras, filters, time_s, recent_s, to)
