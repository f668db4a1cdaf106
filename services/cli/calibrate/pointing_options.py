"""What `rhot calibrate colors` is told of places in pictures: --box, --click and --at, as text, to
pointers. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import msgspec

from rhot.errors import CalibrationError
from rhot.messages import Name
from services.pi_tracker.colors.pointer import Pointer


def numbers_of(text: str) -> list[int]:
    """`10,200,500` as frame numbers."""
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdigit() for part in parts):
        raise CalibrationError(f"--frames {text!r}: expected frame numbers from 0, e.g. 10,200,500")
    return list(dict.fromkeys(int(part) for part in parts))


def places(
    texts: Sequence[str], option: str, sizes: Sequence[int]
) -> list[tuple[str, tuple[float, ...]]]:
    """`color=x,y` or `color=x,y,width,height`, whose count of numbers must be one of sizes."""
    return [_place(text, text, option, sizes) for text in texts]


def _place(
    text: str, whole: str, option: str, sizes: Sequence[int]
) -> tuple[str, tuple[float, ...]]:
    color, equals, rest = text.partition("=")
    form = " or ".join("color=" + "x,y,width,height"[: 3 if size == 2 else None] for size in sizes)
    try:
        values = tuple(float(part) for part in rest.split(","))
        msgspec.convert(color.strip(), Name)
    except ValueError:
        raise CalibrationError(f"{option} {whole!r}: expected {form}, e.g. green=310,200") from None
    if not equals or len(values) not in sizes or not all(abs(value) < 1e6 for value in values):
        raise CalibrationError(f"{option} {whole!r}: expected {form} in px, e.g. green=310,200")
    if len(values) == 4 and min(values[2:]) <= 0.0:
        raise CalibrationError(f"{option} {whole!r}: width and height must be above 0")
    return color.strip(), values


def everywhere(boxes: Sequence[str], clicks: Sequence[str], frames: Iterable[int]) -> list[Pointer]:
    """The same places in each of several pictures: of a hand that is held still."""
    found = [*places(boxes, "--box", (4,)), *places(clicks, "--click", (2,))]
    return [Pointer(color, frame, *values) for frame in frames for color, values in found]


def at(texts: Sequence[str]) -> tuple[list[int], list[Pointer]]:
    """`FRAME:color=x,y[,width,height]`: the frame numbers, and pointers into them in that order."""
    frames: list[int] = []
    pointers: list[Pointer] = []
    for text in texts:
        number, colon, rest = text.partition(":")
        if not colon or not number.strip().isdigit():
            raise CalibrationError(
                f"--at {text!r}: expected FRAME:color=x,y,width,height, e.g. 100:green=290,180,40,40"
            )
        color, values = _place(rest, text, "--at", (2, 4))
        if int(number) not in frames:
            frames.append(int(number))
        pointers.append(Pointer(color, frames.index(int(number)), *values))
    return frames, pointers
