"""One picture of the overlay: markers, hands, and a legend of the angles, drawn with OpenCV. Pure.

Lines are as thick as the picture is high; positions are drawn to a sixteenth of a pixel. Colours
are Okabe and Ito's, which colour-blind readers can tell apart too; grey is what was predicted only.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import CHAIN_JOINTS, JOINT_INDEX
from rhot.messages import HandPose, Marker
from services.pi_tracker.image.frame import Image

Color = tuple[int, int, int]

# BGR, thumb to little finger.
DIGIT_COLORS: tuple[Color, ...] = (
    (0, 94, 213),
    (233, 180, 86),
    (115, 158, 0),
    (66, 228, 240),
    (167, 121, 204),
)
PREDICTED: Color = (150, 150, 150)
_WHITE: Color = (255, 255, 255)
_BLACK: Color = (0, 0, 0)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
# cv2's binary places of positions.
_SHIFT = 4
# Pictures for which lines of one pixel are right.
_HEIGHT_PX = 480.0
# A marker's sigma is a tenth of a pixel: its circle is three of them, and never smaller than this.
_SIGMAS, _MIN_RADIUS_PX = 3.0, 5.0
# Beyond this cv2's fixed-point positions overflow.
_FAR_PX = 1e6


@dataclass(frozen=True)
class Pen:
    """Draws on one picture, which it changes; scale is output pixels for a pixel of the camera."""

    image: Image
    scale: float = 1.0

    @property
    def width(self) -> float:
        """What one pixel of a picture of 480 rows is here."""
        return max(self.image.shape[0] / _HEIGHT_PX, 0.6)

    def line(self, start_px: Array, end_px: Array, color: Color) -> None:
        """A bone, on a dark edge; positions in the camera's pixels."""
        if not (np.abs([start_px, end_px]) < _FAR_PX).all():
            return
        a, b = self._fixed(start_px), self._fixed(end_px)
        for paint, width in ((_BLACK, 4.0), (color, 2.0)):
            thickness = max(1, round(width * self.width))
            cv2.line(self.image, a, b, paint, thickness, cv2.LINE_AA, _SHIFT)

    def circle(self, at_px: Array, radius_px: float, color: Color, *, filled: bool) -> None:
        """A ring or a disc, on a dark edge; the radius in pixels of the output."""
        if not (np.abs(at_px) < _FAR_PX).all():
            return
        centre, radius = self._fixed(at_px), round(radius_px * 2**_SHIFT)
        thin = max(1, round(1.3 * self.width))
        cv2.circle(self.image, centre, radius, _BLACK, thin + 2, cv2.LINE_AA, _SHIFT)
        thickness = cv2.FILLED if filled else thin
        cv2.circle(self.image, centre, radius, color, thickness, cv2.LINE_AA, _SHIFT)

    def cross(self, at_px: Array, arm_px: float, color: Color) -> None:
        """Two thin lines; the arm in pixels of the output."""
        arm = arm_px / self.scale
        for step in (np.array([arm, 0.0]), np.array([0.0, arm])):
            ends = self._fixed(at_px - step), self._fixed(at_px + step)
            cv2.line(self.image, *ends, color, 1, cv2.LINE_AA, _SHIFT)

    def text(
        self, text: str, at: tuple[float, float], color: Color, *, right: bool = False
    ) -> None:
        """A line of text whose left (or right) end stands at a pixel of the output."""
        size, thin = 0.36 * self.width, max(1, round(0.8 * self.width))
        x, y = at
        if right:
            x -= cv2.getTextSize(text, _FONT, size, thin)[0][0]
        # A shadow, and no thicker outline: OpenCV 5 makes bold letters wider.
        for paint, shift in ((_BLACK, max(1, round(self.width))), (color, 0)):
            origin = (round(x) + shift, round(y) + shift)
            cv2.putText(self.image, text, origin, _FONT, size, paint, thin, cv2.LINE_AA)

    def shade(self, left: float, top: float, right: float, bottom: float) -> None:
        """Darkens a box of the output, for text to be read on."""
        rows, columns = slice(max(0, round(top)), round(bottom)), slice(round(left), round(right))
        self.image[rows, columns] = self.image[rows, columns] // 3

    def _fixed(self, at_px: Array) -> tuple[int, int]:
        # Pixel centres stay pixel centres when the picture is scaled.
        x, y = (np.asarray(at_px) + 0.5) * self.scale - 0.5
        return round(float(x) * 2**_SHIFT), round(float(y) * 2**_SHIFT)


def draw_markers(pen: Pen, markers: Iterable[Marker]) -> None:
    """A cross in the middle of each, a circle of its sigma, its colour's name."""
    for marker in markers:
        at_px = np.array([marker.x_px, marker.y_px])
        radius_px = max(_SIGMAS * marker.sigma_px * pen.scale, _MIN_RADIUS_PX * pen.width)
        pen.circle(at_px, radius_px, _WHITE, filled=False)
        pen.cross(at_px, 1.5 * pen.width, _WHITE)
        x, y = (at_px + 0.5) * pen.scale
        pen.text(marker.color, (x + radius_px + 3.0 * pen.width, y - radius_px), _WHITE)


def draw_hand(pen: Pen, pose: HandPose, joints_px: Array) -> None:
    """Bones and joints (26, 2), NaN where the lens shows none.

    Filled joints were measured, rings solved; grey ones only the priors tell.
    """
    predicted = [joint.source == "predicted" for joint in pose.joints]
    for chain, color in zip(digit_bones(), DIGIT_COLORS, strict=True):
        for start, end in pairwise(chain):
            pen.line(joints_px[start], joints_px[end], PREDICTED if predicted[end] else color)
    for chain, color in zip(digit_bones(), DIGIT_COLORS, strict=True):
        for joint in chain:
            paint = _WHITE if joint == JOINT_INDEX["wrist"] else color
            paint = PREDICTED if predicted[joint] else paint
            measured = pose.joints[joint].source == "measured"
            pen.circle(joints_px[joint], 3.0 * pen.width, paint, filled=measured)


def digit_bones() -> Sequence[list[int]]:
    """Joints of each digit from the wrist to the tip, as indices into JOINTS."""
    wrist = JOINT_INDEX["wrist"]
    return [
        [wrist, *([] if row == 0 else [int(chain[0]) - 1]), *map(int, chain)]
        for row, chain in enumerate(CHAIN_JOINTS)
    ]
