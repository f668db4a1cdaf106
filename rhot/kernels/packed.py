"""Arrays for kernels (numba): many of them handed over as one address, and none of them counted.

Numba takes an array from Python in .1 us, or .3 where other work has driven it out of the
processor's caches since, and a hand's filter holds 50: as long as the filter itself takes. What is
packed once is handed over as an integer, its address, which costs next to nothing (`Layout`).

Kernels count who refers to an array, at every view of it and every call that gets it, by locked
instructions, each as long as a dozen sums: a third to a half of what ours took. Nothing is counted
of arrays whose owner a kernel does not know (`unowned`); packed ones are such.

And kernels hand a NamedTuple on number by number, ten for an array: a hand's history is 300, which
every call copied. Packed ones are handed on as their address, too, from which whoever needs an
array takes it; LLVM may keep it, as what is packed stays where it is.
"""

from __future__ import annotations

import hashlib
import struct
from typing import Any

import numpy as np
from llvmlite import ir
from numba import typeof, types
from numba.core.base import BaseContext
from numba.core.datamodel import models
from numba.core.datamodel.manager import DataModelManager
from numba.core.typing.context import BaseContext as TypingContext
from numba.core.typing.templates import AttributeTemplate, Signature
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, register_model
from numba.np.arrayobj import make_array


class Packed:
    """A NamedTuple of arrays and numbers in memory, for kernels to find at its address.

    Arrays are shared, not copied: what is written to them is seen on both sides. Numbers stay as
    they were. Whoever hands the address to a kernel keeps this meanwhile.
    """

    def __init__(self, words: list[int], parts: Any) -> None:
        self._words = np.array(words, dtype=np.int64)
        self.address: int = self._words.ctypes.data
        # What was packed: its arrays live as long as this.
        self.parts = parts


class Layout:
    """How NamedTuples of one kind are packed, and found again.

    `at` is for kernels, and needs a global name there: the parts at an address, which are taken by
    their names (those of a NamedTuple within one, too), and are nothing to iterate over. It raises
    TypeError where something else is packed: the first word tells.
    """

    def __init__(self) -> None:
        self._kind: Any = None
        self.at: Any = intrinsic(self._find)

    def pack(self, parts: Any) -> Packed:
        """A NamedTuple of arrays, floats, integers, and such NamedTuples.

        Raises TypeError if it holds anything else, or other types than the first that was packed.
        """
        kind = typeof(parts)
        self._kind = self._kind or kind
        if kind != self._kind:
            raise TypeError(f"kernels expect {self._kind} in packed memory, not {kind}")
        return Packed([_mark(kind), *_words(kind, parts)], parts)

    def _find(self, _typing: TypingContext, _address: types.Type) -> tuple[Signature, Any]:
        """The code of `at`."""
        kind = self._kind

        def generate(
            context: Any, builder: ir.IRBuilder, _signature: Signature, args: list[ir.Value]
        ) -> ir.Value:
            word = ir.IntType(64)
            found = builder.load(builder.inttoptr(args[0], word.as_pointer()))
            with builder.if_then(builder.icmp_signed("!=", found, word(_mark(kind))), likely=False):
                context.call_conv.return_user_exc(builder, TypeError, (_OTHER,))
            parts = builder.add(args[0], word(8))
            return builder.inttoptr(parts, ir.IntType(8).as_pointer())

        return _PartsType(kind)(types.int64), generate


# What a kernel says that was handed another kind of memory, or compiled for another.
_OTHER = "nothing that this kernel was compiled for is packed at its address"


def _mark(kind: Any) -> int:
    """A word that tells kinds apart."""
    digest = hashlib.sha256(kind.name.encode()).digest()
    return int.from_bytes(digest[:8], "little", signed=True)


def _words(kind: types.Type, part: Any) -> list[int]:
    """A part as numba stores it, in words of 8 bytes."""
    if isinstance(kind, types.BaseTuple):
        kinds: Any = kind
        return [word for of, one in zip(kinds, part, strict=True) for word in _words(of, one)]
    if isinstance(kind, types.Array):
        # Owner and Python's object, none; then as numba.core.datamodel.models.ArrayModel.
        return [0, 0, part.size, part.itemsize, part.ctypes.data, *part.shape, *part.strides]
    if kind in (types.float64, types.int64):
        return list(struct.unpack("q", struct.pack("d" if kind == types.float64 else "q", part)))
    raise TypeError(f"only arrays, floats and integers can be packed, not {kind}")


class _PartsType(types.Type):
    """Of the address of a packed NamedTuple, by the type of that."""

    def __init__(self, packed: Any) -> None:
        """packed: the type of a NamedTuple."""
        self.packed = packed
        super().__init__(name=f"Parts({packed.name})")


@register_model(_PartsType)
class _PartsModel(models.PrimitiveModel):
    """An address."""

    def __init__(self, manager: DataModelManager, kind: types.Type) -> None:
        super().__init__(manager, kind, ir.IntType(8).as_pointer())


@infer_getattr
class _PartsAttributes(AttributeTemplate):
    """Which parts there are: a NamedTuple within one as an address, others as themselves."""

    key = _PartsType

    def generic_resolve(self, kind: Any, name: str) -> Any:  # type: ignore[override]
        if name not in kind.packed.fields:
            return None
        part = kind.packed.types[kind.packed.fields.index(name)]
        return _PartsType(part) if isinstance(part, types.BaseNamedTuple) else part


@lower_getattr_generic(_PartsType)
def _part(
    context: BaseContext, builder: ir.IRBuilder, kind: _PartsType, address: ir.Value, name: str
) -> ir.Value:
    """The code for a part of packed ones."""
    at = kind.packed.fields.index(name)
    part = kind.packed.types[at]
    parts = builder.bitcast(address, context.get_data_type(kind.packed).as_pointer())
    place = builder.gep(parts, [ir.IntType(32)(0), ir.IntType(32)(at)], inbounds=True)
    if isinstance(part, types.BaseNamedTuple):
        return builder.bitcast(place, address.type)
    model = context.data_model_manager[part]
    stored = builder.load(place)
    # It never changes: without this each write to an array might be one to where arrays are.
    stored.set_metadata("invariant.load", builder.module.add_metadata([]))
    return _without_owner(context, builder, part, model.from_data(builder, stored))


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
