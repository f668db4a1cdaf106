"""A reference as a person says it: a rectangle or a length, at pixels of the picture."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.errors import ConfigError
from rhot.geometry.transforms import Array
from studies.grasp.metrology.corners import Corners, corners_of
from studies.grasp.metrology.plane import (
    Plane,
    check_corners,
    checked_length,
    plane_from_length,
    rectangle_mm,
)
from studies.grasp.metrology.pose import plane_seen_by_camera

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


class Known(NamedTuple):
    """A reference's plane, and its points in a picture without distortion."""

    plane: Plane
    seen: Corners

    def about(self) -> str:
        """How sure it is, in words."""
        how = "found by its edges" if self.seen.refined else "as pointed at"
        return f"reference: {how}, to {self.seen.sigma_px:.2f} px"


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
    size_px: tuple[int, int],
    *,
    straighten: Callable[[Array], Array] | None = None,
    matrix: Array | None = None,
    sigma_px: float = CLICK_SIGMA_PX,
    picture: npt.NDArray[np.uint8] | None = None,
) -> Known:
    """The reference's plane in pictures of size_px. straighten takes pixels to those of a picture
    without distortion, matrix is the lens's (3, 3) where it is calibrated. In a picture (h, w, 3),
    if given, a rectangle's own edges are looked for near what was pointed at. A length alone says
    the scale of a plane that the camera looks at squarely.
    """
    flat = straighten or (lambda px: px)
    if len(reference.points_px) == 2:
        ends = Corners(flat(reference.points_px), sigma_px, refined=False)
        first, last = ends.points_px
        plane = plane_from_length(first, last, reference.size_mm[0], sigma_px)
        return Known(plane, ends)
    width = checked_length(reference.size_mm[0], "the rectangle's width")
    height = checked_length(reference.size_mm[1], "the rectangle's height")
    rectangle = rectangle_mm(width, height)
    seen = Corners(flat(reference.points_px), sigma_px, refined=False)
    check_corners(reference.points_px)
    if picture is not None:
        seen = corners_of(picture, reference.points_px, sigma_px, flat)
    plane = plane_seen_by_camera(
        seen.points_px, rectangle, size_px, sigma_px=seen.sigma_px, matrix=matrix
    )
    return Known(plane, seen)


def _numbers(text: str, number: int, whole: str) -> list[float]:
    parts = text.split(",")
    if len(parts) != number or not all(_NUMBER.fullmatch(part.strip()) for part in parts):
        raise ConfigError(
            f"{whole!r}: {text!r} should be {number} number(s), as in"
            f" {'80' if number == 1 else '410,52 or 80x36'}"
        )
    return [float(part) for part in parts]
