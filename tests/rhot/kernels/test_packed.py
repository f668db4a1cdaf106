"""Arrays packed for kernels: shared with Python, and kept alive."""

from __future__ import annotations

import gc
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Packed, pack


class Inner(NamedTuple):
    values: Array
    factor: float


class Outer(NamedTuple):
    inner: Inner
    flags: Array


@njit
def scale(packed: Packed) -> int:
    inner, flags = packed.parts
    inner.values[:] = inner.factor * inner.values
    flags[0] = True
    return int(inner.values.size)


def test_kernels_and_python_share_the_arrays():
    values, flags = np.arange(3.0), np.zeros(2, dtype=np.bool_)
    packed = pack(Outer(Inner(values, 2.0), flags))
    assert scale(packed) == 3
    np.testing.assert_array_equal(values, [0.0, 2.0, 4.0])
    values[0] = 5.0
    scale(packed)
    np.testing.assert_array_equal(values, [10.0, 4.0, 8.0])
    assert flags[0]


def test_arrays_live_as_long_as_what_they_are_packed_in():
    values = np.ones(1000)
    packed = pack(Outer(Inner(values, 2.0), np.zeros(1, dtype=np.bool_)))
    view = values[:1]
    del values
    gc.collect()
    for _ in range(3):
        np.full(1000, 7.0)
        scale(packed)
    assert view[0] == 8.0
