"""A reference as a person says it: a rectangle or a length, at pixels of the picture."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rhot.errors import ConfigError
from rhot.geometry.transforms import Array
from studies.grasp.metrology.plane import Plane, plane_from_length, plane_from_rectangle

EXAMPLE = "rectangle=80x36:410,52:550,60:548,124:408,116"
# How well a corner is pointed at by hand.
CLICK_SIGMA_PX = 1.0
_NUMBER = re.compile(r"-?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?")


class Reference(NamedTuple):
    """size_mm: width and height of a rectangle, or one length; points_px (4, 2) or (2, 2), as the
    camera saw them.
    """

    size_mm: tuple[float, ...]
    points_px: Array


def parse_reference(text: str) -> Reference:
    """`rectangle=WxH:x,y:x,y:x,y:x,y`, corners in order around it, or `length=MM:x,y:x,y`."""
    kind, _, rest = text.partition("=")
    size, *points = rest.split(":")
    counts = {"rectangle": (2, 4), "length": (1, 2)}
    if kind not in counts:
        raise ConfigError(
            f"reference {text!r}: begins with rectangle= or length=, as in {EXAMPLE} (mm, then the"
            " corners' pixels in order)"
        )
    numbers, corners = counts[kind]
    sizes = parse_size(size) if kind == "rectangle" else _numbers(size, 1, size)
    if len(sizes) != numbers or len(points) != corners:
        raise ConfigError(
            f"reference {text!r}: a {kind} has {numbers} size(s) in mm and {corners} points, as in"
            f" {EXAMPLE if kind == 'rectangle' else 'length=80:410,52:550,60'}"
        )
    return Reference(tuple(sizes), np.array([_numbers(one, 2, text) for one in points]))


def parse_size(text: str) -> tuple[float, ...]:
    """`80x36`, mm."""
    return tuple(_numbers(text.replace("x", ","), 2, text))


def parse_points(text: str, number: int) -> Array:
    """`x,y x,y ...`: so many points; (number, 2) px."""
    parts = text.split()
    if len(parts) != number:
        raise ConfigError(
            f"{text!r}: {len(parts)} points, and {number} are needed, as in"
            f" {' '.join(['410,52', '550,60', '548,124', '408,116'][:number])!r}"
        )
    return np.array([_numbers(part, 2, text) for part in parts])


def plane_of(
    reference: Reference,
    straighten: Callable[[Array], Array] | None = None,
    sigma_px: float = CLICK_SIGMA_PX,
) -> Plane:
    """The reference's plane. straighten takes pixels to those of a picture without distortion. A
    length alone says the scale of a plane that the camera looks at squarely.
    """
    points = reference.points_px if straighten is None else straighten(reference.points_px)
    if len(points) == 2:
        return plane_from_length(points[0], points[1], reference.size_mm[0], sigma_px)
    return plane_from_rectangle(points, (reference.size_mm[0], reference.size_mm[1]), sigma_px)


def _numbers(text: str, number: int, whole: str) -> list[float]:
    parts = text.split(",")
    if len(parts) != number or not all(_NUMBER.fullmatch(part.strip()) for part in parts):
        raise ConfigError(
            f"{whole!r}: {text!r} should be {number} number(s), as in"
            f" {'80' if number == 1 else '410,52 or 80x36'}"
        )
    return [float(part) for part in parts]
