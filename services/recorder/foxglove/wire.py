"""The few messages of Foxglove's that a scene of hands and objects needs, as protobuf. Pure.

Written by hand, field by field, as foxglove-sdk's own encoder does (a test compares the bytes): a
recorder should not need a package of 8 MB for two messages. Field numbers are those of the schemas
beside this (FrameTransforms.bin, SceneUpdate.bin: protobuf FileDescriptorSets of foxglove-sdk
0.30, MIT). Metres; quaternions come as wxyz and go out as Foxglove's xyzw.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence

Vec3 = Sequence[float]
Quat = Sequence[float]
Rgba = tuple[float, float, float, float]

_THREE = struct.Struct("<BdBdBd")
_FOUR = struct.Struct("<BdBdBdBd")
_ONE = struct.Struct("<Bd")
# Tags of fields 1, 2, 3 and 4 that hold a double: number * 8 + 1.
_X, _Y, _Z, _W = 9, 17, 25, 33
# LinePrimitive.Type: 0 is a strip, which is the default and not written.


def vector(xyz: Vec3) -> bytes:
    """A Vector3 or Point3."""
    x, y, z = xyz
    return _THREE.pack(_X, x, _Y, y, _Z, z)


def quaternion(wxyz: Quat) -> bytes:
    """A Quaternion."""
    w, x, y, z = wxyz
    return _FOUR.pack(_X, x, _Y, y, _Z, z, _W, w)


def color(rgba: Rgba) -> bytes:
    """A Color."""
    r, g, b, a = rgba
    return _FOUR.pack(_X, r, _Y, g, _Z, b, _W, a)


def inner(number: int, content: bytes) -> bytes:
    """A field that holds a message, a text or bytes."""
    return varint(number << 3 | 2) + varint(len(content)) + content


def varint(value: int) -> bytes:
    """A number in groups of seven bits, the lowest first."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _double(number: int, value: float) -> bytes:
    return _ONE.pack(number << 3 | 1, value)


def _flag(number: int) -> bytes:
    return varint(number << 3) + b"\x01"


def timestamp(stamp_ns: int) -> bytes:
    """A Timestamp or Duration."""
    seconds, nanos = divmod(stamp_ns, 10**9)
    return (b"\x08" + varint(seconds) if seconds else b"") + (
        b"\x10" + varint(nanos) if nanos else b""
    )


def pose(position_m: Vec3, wxyz: Quat) -> bytes:
    """A Pose."""
    return inner(1, vector(position_m)) + inner(2, quaternion(wxyz))


def frame_transform(stamp: bytes, parent: str, child: str, position_m: Vec3, wxyz: Quat) -> bytes:
    """One FrameTransform, as a field of FrameTransforms: p_parent = T @ p_child."""
    return inner(
        1,
        inner(1, stamp)
        + inner(2, parent.encode())
        + inner(3, child.encode())
        + inner(4, vector(position_m))
        + inner(5, quaternion(wxyz)),
    )


def cube(at: bytes, size_m: Vec3, rgba: Rgba) -> bytes:
    """A CubePrimitive of an entity."""
    return inner(8, inner(1, at) + inner(2, vector(size_m)) + inner(3, color(rgba)))


def sphere(at: bytes, diameter_m: float, rgba: Rgba) -> bytes:
    """A SpherePrimitive of an entity."""
    size = inner(2, vector((diameter_m, diameter_m, diameter_m)))
    return inner(9, inner(1, at) + size + inner(3, color(rgba)))


def cylinder(at: bytes, diameter_m: float, height_m: float, rgba: Rgba) -> bytes:
    """A CylinderPrimitive of an entity; its axis is z."""
    size = inner(2, vector((diameter_m, diameter_m, height_m)))
    ends = _double(3, 1.0) + _double(4, 1.0)
    return inner(10, inner(1, at) + size + ends + inner(5, color(rgba)))


def line_strip(at: bytes, points_m: Iterable[Vec3], thickness_m: float, rgba: Rgba) -> bytes:
    """A LinePrimitive of an entity: from point to point."""
    points = b"".join(inner(5, vector(point)) for point in points_m)
    return inner(11, inner(2, at) + _double(3, thickness_m) + points + inner(6, color(rgba)))


def model(at: bytes, data: bytes, media_type: str) -> bytes:
    """A ModelPrimitive of an entity, in its own colours and size."""
    scale = inner(2, vector((1.0, 1.0, 1.0)))
    return inner(14, inner(1, at) + scale + inner(6, media_type.encode()) + inner(7, data))


def scene_update(
    stamp: bytes, frame: str, name: str, primitives: bytes, *, lifetime_ns: int = 0
) -> bytes:
    """A SceneUpdate of one entity that moves with its frame; lifetime 0: until it is replaced.

    primitives in the order of their field numbers: cubes, spheres, cylinders, lines, models.
    """
    life = inner(4, timestamp(lifetime_ns)) if lifetime_ns else b""
    head = inner(1, stamp) + inner(2, frame.encode()) + inner(3, name.encode())
    return inner(2, head + life + _flag(5) + primitives)
