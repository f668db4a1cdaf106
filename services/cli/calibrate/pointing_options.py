"""Where `rhot calibrate colors` finds paint in pictures: --box, --click, --at and --auto, parsed to
pointers. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from rhot.errors import CalibrationError
from rhot.messages import Name

if TYPE_CHECKING:
    from services.pi_tracker.colors.pointer import Pointer

# No picture is wider, px; keeps nonsense out of integers.
_MAX_PX = 1e6
_FORMS = {2: "color=x,y", 4: "color=x,y,width,height"}


@dataclass(frozen=True)
class PointingOptions:
    """Ways of saying what is paint; true if any is used."""

    box: Annotated[
        list[str] | None,
        typer.Option("--box", metavar="COLOR=X,Y,W,H", help="a marker in the pictures; repeatable"),
    ] = None
    click: Annotated[
        list[str] | None,
        typer.Option("--click", metavar="COLOR=X,Y", help="the middle of a marker; repeatable"),
    ] = None
    at: Annotated[
        list[str] | None,
        typer.Option(
            "--at",
            metavar="FRAME:COLOR=X,Y[,W,H]",
            help="a marker in one frame of --video; repeatable",
        ),
    ] = None
    auto: Annotated[
        bool,
        typer.Option(
            "--auto",
            help="propose what moves, and what else stands out, named by its hue",
        ),
    ] = False

    def __bool__(self) -> bool:
        return bool(self.places or self.auto)

    @property
    def places(self) -> list[str]:
        """All that says where something is."""
        return [*(self.box or ()), *(self.click or ()), *(self.at or ())]

    def in_every_frame(self, frames: Iterable[int]) -> list[Pointer]:
        """The boxes and clicks in each of several pictures: of a hand that is held still."""
        from services.pi_tracker.colors.pointer import Pointer

        found = [_parse(text, text, "--box", (4,)) for text in self.box or ()]
        found += [_parse(text, text, "--click", (2,)) for text in self.click or ()]
        return [Pointer(color, frame, *values) for frame in frames for color, values in found]

    def in_single_frames(self) -> tuple[list[int], list[Pointer]]:
        """The frame numbers of --at, and pointers that count these frames in that order."""
        from services.pi_tracker.colors.pointer import Pointer

        frames: list[int] = []
        pointers: list[Pointer] = []
        for text in self.at or ():
            number, colon, rest = text.partition(":")
            if not colon or not number.strip().isdigit():
                raise CalibrationError(
                    f"--at {text!r}: expected FRAME:{_FORMS[4]}, e.g. 100:green=290,180,40,40"
                )
            color, values = _parse(rest, text, "--at", (2, 4))
            if int(number) not in frames:
                frames.append(int(number))
            pointers.append(Pointer(color, frames.index(int(number)), *values))
        return frames, pointers


def frame_numbers(text: str) -> list[int]:
    """`10,200,500` as frame numbers."""
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdigit() for part in parts):
        raise CalibrationError(f"--frames {text!r}: expected frame numbers from 0, e.g. 10,200,500")
    return list(dict.fromkeys(int(part) for part in parts))


def _parse(
    text: str, whole: str, option: str, counts: Sequence[int]
) -> tuple[str, tuple[float, ...]]:
    """`color=x,y` or `color=x,y,width,height`: the colour, and as many numbers as one of counts.

    whole is what the person wrote after the option.
    """
    color, equals, rest = text.partition("=")
    expected = f"{option} {whole!r}: expected {' or '.join(_FORMS[count] for count in counts)}"
    try:
        values = tuple(float(part) for part in rest.split(","))
        msgspec.convert(color.strip(), Name)
    except ValueError:
        raise CalibrationError(f"{expected}, e.g. green=310,200") from None
    if not equals or len(values) not in counts or not all(abs(v) < _MAX_PX for v in values):
        raise CalibrationError(f"{expected} in px, e.g. green=310,200")
    if len(values) == 4 and min(values[2:]) <= 0.0:
        raise CalibrationError(f"{option} {whole!r}: width and height must be above 0")
    return color.strip(), values
