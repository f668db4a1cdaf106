"""What is set on a camera from any machine: colour ranges, exposure, patches of paint to fit to.

Colors and Exposure are calibration files (rhot/files/calibration.py) that travel as they are: what
is sent is what the tracker writes on its machine. Like all messages they are untrusted: what does
not decode or cannot be is refused with a Refusal, and the tracker keeps what it had.
"""

from __future__ import annotations

import hashlib
from typing import Annotated, Any, Literal

import msgspec

from rhot.messages import Marker, Message, Name, Stamp

Hue = Annotated[int, msgspec.Meta(ge=0, le=179)]
Byte = Annotated[int, msgspec.Meta(ge=0, le=255)]
Pixel = Annotated[float, msgspec.Meta(ge=-65536.0, le=65536.0)]
WholePixel = Annotated[int, msgspec.Meta(ge=-65536, le=65536)]
Size = Annotated[int, msgspec.Meta(ge=1, le=65536)]
# Longer than any camera's frame; a gain of 64 is more than sensors have.
Microseconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]
Gain = Annotated[float, msgspec.Meta(ge=0.0, le=64.0)]
# Name of a picture that camera/{camera}/frame answered with: picture_name() of its bytes.
PictureName = Annotated[str, msgspec.Meta(pattern=r"^[0-9a-f]{16}$")]


def picture_name(picture: bytes) -> str:
    """The name of a picture: who has its bytes can speak of it to who sent them."""
    return hashlib.blake2b(picture, digest_size=8).hexdigest()


class Calibration(msgspec.Struct, frozen=True, kw_only=True):
    """What every calibration file says of its making."""

    date: str = ""
    tool: str = ""
    inputs: dict[str, Any] = msgspec.field(default_factory=dict)
    residuals: dict[str, Any] = msgspec.field(default_factory=dict)


class ColorRange(msgspec.Struct, frozen=True, kw_only=True):
    """OpenCV HSV bounds, both inclusive; a low hue above the high one wraps through red."""

    hsv_low: tuple[Hue, Byte, Byte]
    hsv_high: tuple[Hue, Byte, Byte]


class Colors(Calibration, frozen=True, kw_only=True):
    """<camera>.colors.json, and the colour ranges that a tracker uses or is asked to use."""

    colors: dict[str, ColorRange]


class Exposure(Calibration, frozen=True, kw_only=True):
    """<camera>.exposure.json"""

    exposure_us: Annotated[float, msgspec.Meta(gt=0.0)]
    gain: Annotated[float, msgspec.Meta(ge=0.0)]
    red_gain: Annotated[float, msgspec.Meta(ge=0.0)]
    blue_gain: Annotated[float, msgspec.Meta(ge=0.0)]


class ExposureControl(Message, frozen=True, kw_only=True):
    """The exposure a camera has, or is asked to have.

    Asked for with mode "auto", the camera's automatics run until they have settled; then their
    values are frozen, written, and told with mode "fixed". Numbers are 0 where nobody knows them;
    a 0 that is asked for leaves that value as it is. adjustable is false of sources that have no
    such controls (files, the simulator); note says what a person should know; changed_ns is when
    the tracker last changed it.
    """

    mode: Literal["fixed", "auto"] = "fixed"
    exposure_us: Microseconds = 0.0
    gain: Gain = 0.0
    red_gain: Gain = 0.0
    blue_gain: Gain = 0.0
    adjustable: bool = True
    note: str = ""
    changed_ns: Stamp = 0


class SeenInPicture(Message, frozen=True, kw_only=True):
    """What a tracker saw in a preview: the attachment of that very JPEG.

    looked_for are the colours that it looks for: those without a marker are lost, or not in view.
    searched_px is the rectangle that was searched (left, top, right, bottom), None where no single
    one was. Without a running session nothing is looked for, and previews have no attachment.
    """

    stamp_ns: Stamp
    size_px: tuple[Size, Size]
    markers: Annotated[list[Marker], msgspec.Meta(max_length=256)]
    looked_for: Annotated[list[Name], msgspec.Meta(max_length=256)]
    searched_px: tuple[WholePixel, WholePixel, WholePixel, WholePixel] | None = None


class PointedAt(Message, frozen=True, kw_only=True):
    """A click at (x_px, y_px) of a picture, or a box from there if it has a size."""

    color: Name
    picture: PictureName
    x_px: Pixel
    y_px: Pixel
    width_px: Pixel = 0.0
    height_px: Pixel = 0.0


class FitRequest(Message, frozen=True, kw_only=True):
    """Fit ranges to the paint that is pointed at.

    Or, with auto, to whatever stands out in these pictures.
    """

    pointed: Annotated[list[PointedAt], msgspec.Meta(max_length=96)] = msgspec.field(
        default_factory=list
    )
    auto: bool = False
    pictures: Annotated[list[PictureName], msgspec.Meta(max_length=8)] = msgspec.field(
        default_factory=list
    )


class Patch(Message, frozen=True, kw_only=True):
    """A patch of paint that was found: x, y, width, height in px."""

    color: Name
    picture: PictureName
    box_px: tuple[WholePixel, WholePixel, WholePixel, WholePixel]


class FitResult(Message, frozen=True, kw_only=True):
    """Fitted ranges with statistics, and warnings and notes for a person; error if there are none.

    A proposal: the tracker goes on with the ranges it has.
    """

    colors: dict[str, ColorRange] = msgspec.field(default_factory=dict)
    patches: list[Patch] = msgspec.field(default_factory=list)
    residuals: dict[str, Any] = msgspec.field(default_factory=dict)
    warnings: list[str] = msgspec.field(default_factory=list)
    notes: list[str] = msgspec.field(default_factory=list)
    error: str = ""
