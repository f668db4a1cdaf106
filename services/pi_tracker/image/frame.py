"""One image of one camera with its time stamp: what sources yield and the tracker's step takes.

Pure data. A source that does not know its rolling shutter says row_time_ns = 0; every row then
counts as exposed at stamp_ns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy.typing as npt

# uint8; OpenCV's stubs do not say the type of what it returns.
Image = npt.NDArray[Any]
Layout = Literal["i420", "bgr"]


@dataclass(frozen=True, eq=False)
class Frame:
    """One image.

    stamp_ns is mid-exposure of row 0 on the camera's own clock, row_time_ns the time from one image
    row to the next. image is (height * 3 / 2, width) for "i420" (planes Y, U, V without padding;
    BT.601) and (height, width, 3) for "bgr"; size_px is (width, height). full_range: Y of "i420" is
    in 0..255 instead of 16..235, and chroma as much wider about 128.
    """

    camera: str
    seq: int
    stamp_ns: int
    row_time_ns: float
    size_px: tuple[int, int]
    image: Image
    layout: Layout
    full_range: bool = False
