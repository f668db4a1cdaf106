"""Unit quaternions as plain tuples: for what is done to one pose at a time, thousands of times a
second.

The same conventions as rhot/geometry/transforms.py (wxyz with w >= 0, metres, radians), and a test
that both agree. A numpy call on three numbers costs more than the arithmetic: one pose through the
object tracker took 128 us with arrays and takes a fifth of that with tuples.
"""

from __future__ import annotations

import math

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
# Row by row; column 3, where there is one, is a translation and is not read.
Rows = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]

# A rotation vector this short is its own sine to double precision.
_TINY = 1e-9


def normalized(q: Quat) -> Quat:
    """The unit quaternion with w >= 0 in the direction of q, which must not be zero."""
    w, x, y, z = q
    scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    if w < 0.0:
        scale = -scale
    return w * scale, x * scale, y * scale, z * scale


def from_rows(rows: Rows) -> Quat:
    """The quaternion of a rotation matrix: Shepperd's method (1978), right at 180 deg too."""
    (a, b, c, *_), (d, e, f, *_), (g, h, i, *_) = rows
    trace = a + e + i
    if trace >= a and trace >= e and trace >= i:
        return normalized((1.0 + trace, h - f, c - g, d - b))
    if a >= e and a >= i:
        return normalized((h - f, 1.0 - trace + 2.0 * a, b + d, c + g))
    if e >= i:
        return normalized((c - g, b + d, 1.0 - trace + 2.0 * e, f + h))
    return normalized((d - b, c + g, f + h, 1.0 - trace + 2.0 * i))


def multiply(p: Quat, q: Quat) -> Quat:
    """Hamilton product p * q, of any sign."""
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    return (
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def conjugate(q: Quat) -> Quat:
    """The inverse of a unit quaternion."""
    w, x, y, z = q
    return w, -x, -y, -z


def rotate(q: Quat, v: Vec3) -> Vec3:
    """The vector v turned by the unit quaternion q."""
    w, x, y, z = q
    a, b, c = v
    # t = 2 q x v;  v + w t + q x t
    s, t, u = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return (
        a + w * s + y * u - z * t,
        b + w * t + z * s - x * u,
        c + w * u + x * t - y * s,
    )


def from_vector(x: float, y: float, z: float) -> Quat:
    """The quaternion of a rotation vector, in radians."""
    angle = math.sqrt(x * x + y * y + z * z)
    scale = 0.5 if angle < _TINY else math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), x * scale, y * scale, z * scale


def to_vector(q: Quat) -> Vec3:
    """The rotation vector of a unit quaternion of any sign, of length 0..pi rad."""
    w, x, y, z = q
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    norm = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if norm < _TINY else 2.0 * math.atan2(norm, w) / norm
    return x * scale, y * scale, z * scale


def slerp(p: Quat, q: Quat, share: float) -> Quat:
    """The rotation a share of the shortest way from p to q."""
    x, y, z = to_vector(multiply(q, conjugate(p)))
    return normalized(multiply(from_vector(x * share, y * share, z * share), p))
