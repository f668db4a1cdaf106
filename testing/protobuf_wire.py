"""Protocol Buffers, read by their own descriptors: enough to look into Foxglove's messages with a
decoder that is neither Foxglove's nor the bridge's.

After the encoding's specification (protobuf.dev, "Encoding") and descriptor.proto.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

_REPEATED = 3


def fields(content: bytes) -> Iterator[tuple[int, Any]]:
    """Each field's number with its raw value: an integer, or bytes."""
    at = 0
    while at < len(content):
        key, at = _varint(content, at)
        match key & 7:
            case 0:
                value, at = _varint(content, at)
            case 1:
                value, at = content[at : at + 8], at + 8
            case 5:
                value, at = content[at : at + 4], at + 4
            case _:
                size, at = _varint(content, at)
                value, at = content[at : at + size], at + size
        yield key >> 3, value


class Schema:
    """The messages of a FileDescriptorSet."""

    def __init__(self, descriptors: bytes) -> None:
        # Name of a message -> its fields by number: name, repeated, type, name of the type.
        self._messages: dict[str, dict[int, tuple[str, bool, int, str]]] = {}
        for _, file in fields(descriptors):
            own = dict(fields(file))
            for number, message in fields(file):
                if number == 4:
                    self._add(f".{own[2].decode()}", message)

    def _add(self, package: str, message: bytes) -> None:
        name = next(
            f"{package}.{value.decode()}" for number, value in fields(message) if number == 1
        )
        found = self._messages.setdefault(name, {})
        for number, value in fields(message):
            if number == 2:
                field = dict(fields(value))
                kind = field.get(6, b"").decode()
                found[field[3]] = field[1].decode(), field[4] == _REPEATED, field[5], kind
            elif number == 3:
                self._add(name, value)

    def decode(self, name: str, content: bytes) -> dict[str, Any]:
        """A message as a dictionary, by the name of its type: .foxglove.SceneUpdate"""
        told: dict[str, Any] = {}
        for number, raw in fields(content):
            field, repeated, kind, type_name = self._messages[name][number]
            value = self._value(raw, kind, type_name)
            if repeated:
                told.setdefault(field, []).append(value)
            else:
                told[field] = value
        return told

    def _value(self, raw: Any, kind: int, type_name: str) -> Any:
        match kind:
            case 1:
                return struct.unpack("<d", raw)[0]
            case 7:
                return struct.unpack("<I", raw)[0]
            case 8:
                return bool(raw)
            case 9:
                return raw.decode()
            case 11:
                return self.decode(type_name, raw)
            case _:
                return raw


def _varint(content: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = content[at]
        value, shift, at = value | (byte & 127) << shift, shift + 7, at + 1
        if byte < 128:
            return value, at
