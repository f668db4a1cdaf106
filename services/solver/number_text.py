"""Numbers as the JSON that msgspec writes of them, by kernels: decimals of a fixed place, exactly.

What is rounded to a millionth is a whole number of millionths, whose shortest text is its digits
without the zeros at the end: no search for it, as for any number, and no Python object of each.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array

Bytes = npt.NDArray[np.uint8]
Integers = npt.NDArray[np.int64]

# Longest text of a number; digits that a number has without loss; the least that has no exponent.
_LONGEST, _DIGITS, _LEAST_EXPONENT = 32, 15, -5
_ZERO, _POINT, _MINUS, _EXPONENT = 48, 46, 45, 101


class Template(NamedTuple):
    """A text with gaps for numbers: the k-th number stands behind the k-th piece."""

    text: Bytes  # all pieces
    ends: Integers  # (n + 1,) of each piece in text
    # (n,) which number stands in each gap, and how many decimals it has, -1: a whole number.
    slots: Integers
    decimals: Integers


@njit(cache=True)
def filled(template: Template, numbers: Array) -> Bytes:
    """The text with its numbers (m,), empty if one has no exact text here.

    That is: more decimals than its gap has, more digits than a number holds, not finite.
    """
    out = np.empty(template.text.size + _LONGEST * template.slots.size, dtype=np.uint8)
    begin = length = 0
    for k in range(template.ends.size):
        piece = template.ends[k] - begin
        out[length : length + piece] = template.text[begin : template.ends[k]]
        begin, length = template.ends[k], length + piece
        if k < template.slots.size:
            length = _write(out, length, numbers[template.slots[k]], template.decimals[k])
            if length < 0:
                return out[:0]
    return out[:length]


@njit(cache=True)
def _write(out: Bytes, at: int, value: float, decimals: int) -> int:
    """Write a number; where it ends, -1 if it cannot be written."""
    scale = 10.0 ** max(decimals, 0)
    scaled = np.rint(abs(value) * scale)
    if not (scaled < 10.0**_DIGITS and scaled / scale == abs(value)):
        return -1
    if math.copysign(1.0, value) < 0.0:
        out[at] = _MINUS
        at += 1
    whole = int(scaled)
    while decimals > 0 and whole % 10 == 0:
        whole //= 10
        decimals -= 1
    digits = np.empty(_DIGITS + 1, dtype=np.uint8)  # from the last one
    count = 0
    while whole > 0 or count == 0:
        digits[count] = _ZERO + whole % 10
        whole //= 10
        count += 1
    exponent = count - decimals - 1  # of the first digit
    if decimals > 0 and exponent < _LEAST_EXPONENT:
        return _write_small(out, at, digits[:count], -exponent)
    places = max(count, max(decimals, 0) + 1)
    for place in range(places - 1, -1, -1):
        out[at] = digits[place] if place < count else _ZERO
        at += 1
        if place == decimals and decimals >= 0:
            out[at] = _POINT
            at += 1
    if decimals == 0:
        out[at] = _ZERO
        at += 1
    return at


@njit(cache=True)
def _write_small(out: Bytes, at: int, digits: Bytes, exponent: int) -> int:
    """Write d.ddde-x; digits are from the last one."""
    for place in range(digits.size - 1, -1, -1):
        out[at] = digits[place]
        at += 1
        if place == digits.size - 1 and place > 0:
            out[at] = _POINT
            at += 1
    out[at], out[at + 1] = _EXPONENT, _MINUS
    at += 2
    if exponent >= 10:
        out[at] = _ZERO + exponent // 10
        at += 1
    out[at] = _ZERO + exponent % 10
    return at + 1
