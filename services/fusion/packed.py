"""Arrays that kernels are handed again and again, packed for them into one object.

Numba takes an array from Python in .1 us, or .3 where other work has driven it out of the
processor's caches since, and a hand's filter holds 50: as long as the filter itself takes. One
object takes .7 and 1.5 us, however much it holds.
"""

from __future__ import annotations

from typing import Any

from numba import njit, types
from numba.experimental import structref


@structref.register
class _PackedType(types.StructRef):
    """Of a Packed, by the types of its parts."""


class Packed(structref.StructRefProxy):
    """A NamedTuple of arrays and numbers, which compiled functions get as .parts.

    Arrays are shared, not copied: what is written to them is seen on both sides. Numbers stay as
    they were. Made by `pack`: the type's own constructor is compiled anew by every process.
    """

    parts: Any


structref.define_boxing(_PackedType, Packed)
structref.define_constructor(Packed, _PackedType, ["parts"])


@njit(cache=True)
def pack(parts: Any) -> Packed:
    """A NamedTuple, ready to be handed to kernels."""
    return Packed(parts)
