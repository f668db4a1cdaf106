"""The legend of an overlay: the angles of a hand, and which frame this is. Pure."""

from __future__ import annotations

import numpy as np

from rhot.hand import DIGITS, FINGER_ANGLES, THUMB_ANGLES
from services.cli.plot.overlay.draw import DIGIT_COLORS, PREDICTED, Pen
from services.cli.plot.overlay.hand_track import ShownHand

_WHITE = (255, 255, 255)
# Pixels of a picture of 480 rows: heights of lines, width of the names, of a number, of the edge.
_LINE, _NAME, _CELL, _EDGE = 13.0, 52.0, 34.0, 6.0
_SHORT = {"abduction": "abd"}


def draw_legend(pen: Pen, hand: ShownHand) -> None:
    """A table of the angles in deg with their sigma: a left hand's at the left, a right one's at
    the right. Grey rows are of digits that were only predicted.
    """
    unit = pen.width
    columns = len(FINGER_ANGLES) + 1
    width = (2 * _EDGE + _NAME + columns * _CELL) * unit
    left = 0.0 if hand.hand == "left" else pen.image.shape[1] - width
    rows = _rows(hand)
    pen.shade(left, 0.0, left + width, (len(rows) * _LINE + 2 * _EDGE) * unit)
    for number, (name, cells, color) in enumerate(rows):
        y = (_EDGE + (number + 0.75) * _LINE) * unit
        pen.text(name, (left + _EDGE * unit, y), color)
        for column, cell in enumerate(cells, start=1):
            x = left + (_EDGE + _NAME + column * _CELL) * unit
            pen.text(cell, (x, y), color, right=True)


def _rows(hand: ShownHand) -> list[tuple[str, list[str], tuple[int, int, int]]]:
    """(name, cells, colour) of each line: the thumb's angles have other names than the fingers'."""
    degrees = np.rad2deg(hand.angles_rad)
    rows = [(f"{hand.hand}, deg", _names(THUMB_ANGLES), _WHITE)]
    for row, (digit, finger) in enumerate(zip(DIGITS, hand.pose.fingers, strict=True)):
        if row == 1:
            rows.append(("", _names(FINGER_ANGLES), _WHITE))
        cells = [f"{angle:.0f}" for angle in degrees[row]]
        sigma = finger.sigma_rad
        cells.append("" if sigma is None else f"{np.rad2deg(sigma):.1f}")
        color = PREDICTED if finger.status == "predicted" else DIGIT_COLORS[row]
        rows.append((digit, cells, color))
    return rows


def _names(angles: tuple[str, ...]) -> list[str]:
    return [*(_SHORT.get(name, name) for name in angles), "sigma"]


def draw_time(pen: Pen, camera: str, number: int, time_s: float) -> None:
    """Which frame of which camera, and when, in the lower left corner."""
    unit = pen.width
    height = pen.image.shape[0]
    pen.shade(0.0, height - (_LINE + _EDGE) * unit, 190.0 * unit, height)
    text = f"{time_s:.3f} s   {camera}, frame {number}"
    pen.text(text, (_EDGE * unit, height - _EDGE * unit), _WHITE)
