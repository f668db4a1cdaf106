"""Arrays packed for kernels: shared with Python, and kept alive."""

from __future__ import annotations

import gc
import sys
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Layout, unowned


class Inner(NamedTuple):
    values: Array
    factor: float


class Outer(NamedTuple):
    inner: Inner
    flags: Array


OUTER, INNER = Layout(), Layout()
outer_at, inner_at = OUTER.at, INNER.at


@njit
def scale(address: int) -> int:
    outer = outer_at(address)
    outer.inner.values[:] = outer.inner.factor * outer.inner.values
    outer.flags[0] = True
    return doubled(outer.inner)


@njit
def doubled(inner: Inner) -> int:
    return 2 * inner.values.size


def test_kernels_and_python_share_the_arrays():
    values, flags = np.arange(3.0), np.zeros(2, dtype=np.bool_)
    packed = OUTER.pack(Outer(Inner(values, 2.0), flags))
    assert scale(packed.address) == 6
    np.testing.assert_array_equal(values, [0.0, 2.0, 4.0])
    values[0] = 5.0
    scale(packed.address)
    np.testing.assert_array_equal(values, [10.0, 4.0, 8.0])
    assert flags[0]


def test_arrays_live_as_long_as_what_they_are_packed_in():
    values = np.ones(1000)
    packed = OUTER.pack(Outer(Inner(values, 2.0), np.zeros(1, dtype=np.bool_)))
    view = values[:1]
    del values
    gc.collect()
    for _ in range(3):
        np.full(1000, 7.0)
        scale(packed.address)
    assert view[0] == 8.0


class Mixed(NamedTuple):
    count: int
    grid: Array
    share: float
    flags: Array
    inner: Inner


def mixed_of(grid: Array) -> Mixed:
    return Mixed(1, grid, 0.0, np.zeros(1, dtype=np.bool_), Inner(np.ones(1), 1.0))


MIXED = Layout()
mixed_at = MIXED.at


@njit
def read(address: int) -> tuple[int, float, float, int, float]:
    mixed = mixed_at(address)
    return (
        mixed.count,
        mixed.grid[1, 2, 3] + mixed.grid.shape[2],
        mixed.share,
        np.count_nonzero(mixed.flags),
        mixed.inner.factor + mixed.inner.values.sum(),
    )


def test_all_kinds_of_parts_are_found_where_they_were_put():
    flags = np.array([True, False, True])
    grid = np.arange(24.0).reshape(2, 3, 4)
    packed = MIXED.pack(Mixed(-7, grid, -0.25, flags, Inner(np.ones(2), 0.5)))
    assert read(packed.address) == (-7, 23.0 + 4, -0.25, 2, 2.5)


def test_another_kind_of_memory_is_refused():
    mixed = MIXED.pack(mixed_of(np.zeros((2, 3, 4))))
    read(mixed.address)
    other = INNER.pack(Inner(np.ones(2), 0.5))
    with pytest.raises(TypeError, match="kernel was compiled for"):
        read(other.address)


def test_only_what_kernels_read_right_is_packed():
    MIXED.pack(mixed_of(np.zeros((1, 1, 1))))
    with pytest.raises(TypeError, match="kernels expect"):
        MIXED.pack(mixed_of(np.zeros(3)))
    with pytest.raises(TypeError, match="only arrays, floats and integers"):
        Layout().pack(Inner(np.ones(1), True))


@njit
def fill(given: tuple[Inner, Array, int]) -> float:
    inner, out, start = unowned(given)
    for n in range(out.shape[0]):
        row = out[n]
        row[:] = start + n * inner.factor
    return float(out.sum())


@njit
def made_and_filled(count: int) -> float:
    """Memory of its own, handed on; and more of it, lest freed memory hold what was there."""
    total = 0.0
    for start in range(count):
        total += fill((Inner(np.zeros(1), 2.0), np.empty((3, 4)), start))
        total += np.full((3, 4), 1e9)[0, 0] - 1e9
    return total


def test_kernels_count_nothing_of_what_they_were_given():
    out = np.zeros((3, 2))
    references = sys.getrefcount(out)
    assert fill((Inner(np.zeros(1), 2.0), out, 1)) == 18.0
    np.testing.assert_array_equal(out, [[1.0, 1.0], [3.0, 3.0], [5.0, 5.0]])
    assert sys.getrefcount(out) == references
    counted = [name for name in fill.inspect_asm().values() if "NRT_incref" in name]
    assert not counted


def test_memory_that_a_kernel_made_lasts_while_another_works_with_it():
    assert made_and_filled(1000) == 12.0 * sum(range(1000)) + 1000 * 4.0 * 2.0 * 3.0
