"""What goes into the tracker of dots and what comes out: patches of one colour, dots with a name.

Pure data. Positions are pixels of the picture, x right, y down, (0, 0) in the middle of the first.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

# "seen": a patch of its own; "merged": it shares a patch with a dot that it touches or hides
# behind; "carried": not seen, where the other dots and its own motion say it must be.
State = Literal["seen", "merged", "carried"]


class Patch(NamedTuple):
    """A patch of the dots' colour, or a part of one that several dots may share.

    whole: patches of the same number are parts of one; then whole_px is the centre of all of it.
    """

    x_px: float
    y_px: float
    area_px: float
    sigma_px: float = 0.3  # one standard deviation of each coordinate
    quality: float = 1.0  # 0..1, of the measurement
    whole: int = -1
    whole_px: tuple[float, float] = (0.0, 0.0)


class Dot(NamedTuple):
    """A dot at one instant.

    quality, 0..1, is that of the measurement times the probability that it is this dot and no
    other; a carried dot has 0. patch is the index of its patch, -1 of a carried one.
    """

    x_px: float
    y_px: float
    sigma_px: float  # one standard deviation of each coordinate
    quality: float
    state: State
    area_px: float
    patch: int


class SeenPatches(NamedTuple):
    """The patches of a picture, in the order in which they were found."""

    time_s: float
    patches: list[Patch]
