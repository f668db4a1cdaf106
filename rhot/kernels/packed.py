"""Arrays for kernels (numba): many packed into one object, and none of them counted.

Numba takes an array from Python in .1 us, or .3 where other work has driven it out of the
processor's caches since, and a hand's filter holds 50: as long as the filter itself takes. One
object takes .7 and 1.5 us, however much it holds (`pack`).

Kernels count who refers to an array, at every view of it and every call that gets it, by locked
instructions, each as long as a dozen sums: a third to a half of what ours took. Nothing is counted
of arrays whose owner a kernel does not know (`unowned`); packed ones are such.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core.base import BaseContext
from numba.core.typing.context import BaseContext as TypingContext
from numba.core.typing.templates import Signature
from numba.experimental import structref
from numba.extending import intrinsic
from numba.np.arrayobj import make_array


@structref.register
class _PackedType(types.StructRef):
    """Of a Packed, by the types of its parts."""


class Packed(structref.StructRefProxy):
    """A NamedTuple of arrays and numbers, which compiled functions get as .parts; by `pack`.

    Arrays are shared, not copied: what is written to them is seen on both sides. Numbers stay as
    they were.
    """

    parts: Any
    # What was packed: its arrays live as long as this.
    owned: Any


structref.define_boxing(_PackedType, Packed)
structref.define_constructor(Packed, _PackedType, ["parts"])


def pack(parts: Any) -> Packed:
    """A NamedTuple, ready to be handed to kernels."""
    packed: Packed = _pack(parts)
    packed.owned = parts
    return packed


@njit(cache=True)
def _pack(parts: Any) -> Packed:
    # The type's own constructor is compiled anew by every process.
    return Packed(unowned(parts))


def _lowered(_typing: TypingContext, parts: types.Type) -> tuple[Signature, Any]:
    def generate(
        context: BaseContext, builder: ir.IRBuilder, signature: Signature, args: list[ir.Value]
    ) -> ir.Value:
        return _without_owner(context, builder, signature.args[0], args[0])

    return parts(parts), generate


# For kernels: the same arrays, in tuples of tuples, as references that nobody counts. Only of what
# a kernel was given, which whoever calls keeps alive until it returns; nothing of it may be
# returned. Not of what a kernel made itself, which numba frees after the last use that it knows of:
# that is handed to another kernel.
unowned: Any = intrinsic(_lowered)


def _without_owner(
    context: BaseContext, builder: ir.IRBuilder, kind: types.Type, value: ir.Value
) -> ir.Value:
    """The code for it: arrays refer to no owner of their memory, and to no Python object."""
    if isinstance(kind, types.Array):
        array = make_array(kind)(context, builder, value)
        for name in ("meminfo", "parent"):
            setattr(array, name, ir.Constant(getattr(array, name).type, None))
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        kinds: Any = kind
        items = [
            _without_owner(context, builder, of, builder.extract_value(value, n))
            for n, of in enumerate(kinds)
        ]
        return context.make_tuple(builder, kind, items)
    return value
