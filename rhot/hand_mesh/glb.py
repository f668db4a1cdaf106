"""Binary glTF 2.0 (.glb): its JSON and its one buffer, read from a file of ours and written. Pure.

After the Khronos specification, section 4.4 (binary glTF layout).
"""

from __future__ import annotations

import struct
from typing import Any

import msgspec
import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array

_MAGIC, _VERSION, _JSON, _BIN = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
# glTF's component types and element types that we meet: numpy's, and numbers an element.
_COMPONENTS: dict[int, str] = {5121: "u1", 5123: "<u2", 5126: "<f4"}
_ELEMENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Glb:
    """A document and its buffer; accessors are read and added as arrays."""

    def __init__(self, document: dict[str, Any], buffer: bytes) -> None:
        self.document = document
        self._buffer = bytearray(buffer)

    @classmethod
    def parse(cls, content: bytes) -> Glb:
        """Raises CalibrationError if it is no binary glTF 2.0."""
        try:
            magic, version, _ = struct.unpack_from("<3I", content)
            size, kind = struct.unpack_from("<2I", content, 12)
            if (magic, version, kind) != (_MAGIC, _VERSION, _JSON):
                raise CalibrationError("is no binary glTF 2.0")
            document = msgspec.json.decode(content[20 : 20 + size])
            bytes_, _ = struct.unpack_from("<2I", content, 20 + size)
        except (struct.error, msgspec.DecodeError) as error:
            raise CalibrationError(f"is no binary glTF 2.0: {error}") from None
        return cls(document, content[28 + size : 28 + size + bytes_])

    def array(self, accessor: int) -> Array:
        """The values (count, n) of an accessor."""
        about = self.document["accessors"][accessor]
        view = self.document["bufferViews"][about["bufferView"]]
        kind, n = _COMPONENTS[about["componentType"]], _ELEMENTS[about["type"]]
        start = view.get("byteOffset", 0) + about.get("byteOffset", 0)
        values = np.frombuffer(self._buffer, np.dtype(kind), about["count"] * n, start)
        return values.reshape(-1, n).copy()

    def add(self, values: Array) -> int:
        """The accessor of new values (count, n), as float32, with their bounds."""
        values = np.ascontiguousarray(values, dtype="<f4")
        kind = next(name for name, n in _ELEMENTS.items() if n == values.shape[1])
        views, accessors = self.document["bufferViews"], self.document["accessors"]
        self._buffer += bytes(-len(self._buffer) % 4)
        views.append({"buffer": 0, "byteOffset": len(self._buffer), "byteLength": values.nbytes})
        self._buffer += values.tobytes()
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        about = {"bufferView": len(views) - 1, "componentType": 5126, "count": len(values)}
        accessors.append(about | {"type": kind} | bounds)
        return len(accessors) - 1

    def encoded(self) -> bytes:
        """The whole file."""
        buffer = bytes(self._buffer) + bytes(-len(self._buffer) % 4)
        self.document["buffers"] = [{"byteLength": len(buffer)}]
        text = msgspec.json.encode(self.document)
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + len(buffer)
        return b"".join(
            [
                struct.pack("<3I", _MAGIC, _VERSION, size),
                struct.pack("<2I", len(text), _JSON),
                text,
                struct.pack("<2I", len(buffer), _BIN),
                buffer,
            ]
        )
