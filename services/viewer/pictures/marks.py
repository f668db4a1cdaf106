"""What the tracker saw in a picture, as SVG over it: found, lost, where it was looked for. Pure.

The message is untrusted: what lies outside its picture is not drawn.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterator

from rhot.messages import Marker
from rhot.messages.camera import SeenInPicture

# A lost colour is shown where it was last for so long: later it says little of where it is now.
_LOST_NS = 5_000_000_000
# A marker's circle is three sigma, and at least this share of the picture's width: sigma is
# hundredths of a pixel.
_SIGMAS, _MIN_RADIUS = 3.0, 0.018
# Letters and lines, as shares of the picture's width: readable where it is 350 pixels wide.
_LETTER, _LINE = 1.0 / 26.0, 1.0 / 320.0
# A letter's breadth for its height: the mean of a broad sans-serif's small letters and its outline.
_BROAD = 0.68
_WHITE, _LOST, _SEARCHED = "#ffffff", "#ffb000", "#7fd4ff"
# Names of colours that are not in view, before they are counted.
_MAX_NAMES = 6


class Marks:
    """The marks of one camera's pictures; it remembers where each colour was last."""

    def __init__(self) -> None:
        # By colour: the picture's stamp, and the marker.
        self._last: dict[str, tuple[int, Marker]] = {}

    def svg(self, seen: SeenInPicture) -> str:
        """The marks of a picture, to be laid over it: as large as its parent."""
        width, height = seen.size_px
        inside = [one for one in seen.markers if _inside(one, seen)]
        found = {one.color: (seen.stamp_ns, one) for one in inside}
        kept = {
            color: (stamp_ns, one)
            for color, (stamp_ns, one) in self._last.items()
            # A clock that was set back, or another recording, is no past.
            if color in seen.looked_for and 0 <= seen.stamp_ns - stamp_ns <= _LOST_NS
        }
        self._last = {**kept, **found}
        lost = [one for color, (_, one) in kept.items() if color not in found]
        names = _Names(width)
        drawn = [
            *_region(seen),
            *(_circle(one, width, _WHITE, dashed=False) for one in inside),
            *(_circle(one, width, _LOST, dashed=True) for one in lost),
            # Names over all rings, and each beside those before it: fingers come close together.
            *(names.of(one, one.color, _WHITE) for one in inside),
            *(names.of(one, f"{one.color}: lost", _LOST) for one in lost),
            _caption(seen, set(self._last)),
        ]
        return (
            f'<svg viewBox="0 0 {width} {height}" '
            'style="position:absolute;left:0;top:0;width:100%;height:100%" '
            f'font-family="sans-serif" font-size="{_LETTER * width:.1f}" '
            f'stroke-width="{_LINE * width:.2f}" fill="none">{"".join(drawn)}</svg>'
        )


def _inside(marker: Marker, seen: SeenInPicture) -> bool:
    """Whether any of it is: the picture's edge may cut a marker."""
    width, height = seen.size_px
    out = 0.5 + min(math.sqrt(marker.area_px / math.pi), width / 8.0)
    return -out <= marker.x_px <= width - 1.0 + out and -out <= marker.y_px <= height - 1.0 + out


def _region(seen: SeenInPicture) -> Iterator[str]:
    """The rectangle that was searched, unless it is the whole picture."""
    if seen.searched_px is None or _whole(seen):
        return
    left, top, right, bottom = seen.searched_px
    width, height = max(0, right - left), max(0, bottom - top)
    yield (
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" stroke="{_SEARCHED}" '
        f'stroke-dasharray="{4 * _LINE * seen.size_px[0]:.1f}"/>'
    )


def _whole(seen: SeenInPicture) -> bool:
    if seen.searched_px is None:
        return False
    left, top, right, bottom = seen.searched_px
    width, height = seen.size_px
    # Cells of two pixels leave the last one of an odd size out.
    return left <= 0 and top <= 0 and right >= width - 1 and bottom >= height - 1


def _circle(marker: Marker, width: int, color: str, *, dashed: bool) -> str:
    x, y, radius = _ring(marker, width)
    dash = f' stroke-dasharray="{2 * _LINE * width:.1f}"' if dashed else ""
    ring = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}"'
    # Black below white: seen on any paint.
    return (
        f'{ring} stroke="#000" stroke-width="{2.5 * _LINE * width:.2f}" opacity="0.6"/>'
        f'{ring} stroke="{color}"{dash}/>'
    )


def _ring(marker: Marker, width: int) -> tuple[float, float, float]:
    """Centre and radius; pixel centres are whole numbers, SVG's are halves."""
    radius = min(max(_SIGMAS * marker.sigma_px, _MIN_RADIUS * width), 0.1 * width)
    return marker.x_px + 0.5, marker.y_px + 0.5, radius


class _Names:
    """Places the names of one picture's markers where none covers another."""

    def __init__(self, width: int) -> None:
        self._width, self._letter = width, _LETTER * width
        # Left, top, right and bottom of each.
        self._taken: list[tuple[float, ...]] = []

    def of(self, marker: Marker, words: str, color: str) -> str:
        """A name above its ring; beside or below it where there is no room."""
        x, y, radius = _ring(marker, self._width)
        beside, middle = 1.5 * radius, y + 0.35 * self._letter
        places = (
            (x, y - 1.4 * radius, _anchor(x, self._width)),
            (x + beside, middle, "start"),
            (x - beside, middle, "end"),
            (x, y + 1.3 * radius + self._letter, _anchor(x, self._width)),
        )
        place = next((one for one in places if self._is_free(self._box(*one, words))), places[0])
        self._taken.append(self._box(*place, words))
        return _words(*place[:2], words, color, self._width, anchor=place[2])

    def _box(self, x: float, y: float, anchor: str, words: str) -> tuple[float, ...]:
        long = _BROAD * self._letter * len(words)
        left = x - long * {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
        bottom = max(y, self._letter)
        return left, bottom - self._letter, left + long, bottom

    def _is_free(self, box: tuple[float, ...]) -> bool:
        left, top, right, bottom = box
        apart = (
            right <= one[0] or one[2] <= left or bottom <= one[1] or one[3] <= top
            for one in self._taken
        )
        return left >= 0.0 and right <= self._width and all(apart)


def _anchor(x: float, width: int) -> str:
    """Where a text begins so that it stays in the picture."""
    return "start" if x < 0.2 * width else "end" if x > 0.8 * width else "middle"


def _words(x: float, y: float, words: str, color: str, width: int, anchor: str) -> str:
    letter = _LETTER * width
    return (
        f'<text x="{x:.1f}" y="{max(y, letter):.1f}" text-anchor="{anchor}" fill="{color}" '
        f'stroke="#000" stroke-width="{2 * _LINE * width:.2f}" paint-order="stroke">'
        f"{html.escape(words)}</text>"
    )


def _caption(seen: SeenInPicture, placed: set[str]) -> str:
    """In the lower corner: what is nowhere, and how it is looked for."""
    width, height = seen.size_px
    missing = [color for color in seen.looked_for if color not in placed]
    more = f" and {len(missing) - _MAX_NAMES} more" if len(missing) > _MAX_NAMES else ""
    words = f"not in view: {', '.join(missing[:_MAX_NAMES])}{more}" if missing else ""
    if _whole(seen):
        words = f"{words}; " * bool(words) + "searched everywhere"
    return _words(0.01 * width, height - 0.4 * _LETTER * width, words, _SEARCHED, width, "start")
