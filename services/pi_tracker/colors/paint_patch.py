"""The painted patch a person points at: grown from a click, or found in a box drawn around it.
Pure.

A patch shades from light to dark and bleeds into skin at its rim; its chroma over luma stays, and
that is what it is grown by. A click on something grey, a box without a colour of its own, and
places outside the picture are CalibrationErrors saying so.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rhot.errors import CalibrationError
from services.pi_tracker.image.chroma import Array, Cells, Mask

# Chroma of grey walls in real video is 2 +- 2 grey levels (99 %: 5); a pastel ball in poor light
# has 12.
MIN_CHROMA = 6.0
# A patch smaller than three cells (12 px) is not looked for by the tracker either, by default; its
# colours would be the rim's.
MIN_CELLS = 3
# Cells about a click in which its colour is read: a person hits the middle of a finger tip to
# within two of them.
_REACH = 2
# A patch's chroma over luma varies this much across its direction and along it: shading and lamps
# of different colour turn it little, highlights pale it more. Twice the quantiles measured on a
# pastel ball.
_TURN, _PALER, _DEEPER = 0.30, 0.40, 2.2
# Besides, noise and video compression move chroma by this many grey levels.
_NOISE = 2.5
# Half side of the window a click grows in, as share of the picture's width: markers are far
# smaller, a calibration ball may be 1/6 wide.
_WINDOW = 1.0 / 8.0
# Bins of colour, when those inside a box are held against those around it: directions of chroma (5
# degrees), and half octaves of its share of luma, from that of a wall that is not quite grey.
_TURNS, _DEPTHS, _WEAKEST = 72, 12, 0.03
# A colour that is so many times as frequent in the box as around it belongs to what is boxed.
_OWN = 3.0


@dataclass(frozen=True)
class Pointer:
    """What a person points at in picture `frame`: a click at (x, y), or a box (x, y, width, height)
    with a size; full-image pixels.
    """

    color: str
    frame: int
    x_px: float
    y_px: float
    width_px: float = 0.0
    height_px: float = 0.0

    @property
    def is_box(self) -> bool:
        return self.width_px > 0.0 or self.height_px > 0.0

    def __str__(self) -> str:
        if self.is_box:
            return (
                f"box {self.color}={self.x_px:g},{self.y_px:g},{self.width_px:g},{self.height_px:g}"
            )
        return f"click {self.color}={self.x_px:g},{self.y_px:g}"


@dataclass(frozen=True, eq=False)
class Swatch:
    """One patch in one picture, as masks of the whole picture: its cells, those clear of its rim,
    and all that belongs to it.
    """

    color: str
    frame: int
    mask: Mask  # (h, w)
    core: Mask  # (h, w)
    whole: Mask  # (h, w)

    @property
    def box_px(self) -> tuple[int, int, int, int]:
        """x, y, width, height."""
        rows, columns = np.nonzero(self.mask)
        x, y = 2 * int(columns.min()), 2 * int(rows.min())
        return x, y, 2 * int(columns.max()) + 2 - x, 2 * int(rows.max()) + 2 - y


def find_swatch(cells: Cells, pointer: Pointer) -> Swatch:
    """The patch that is pointed at.

    Raises CalibrationError if there is none, or the place lies outside the picture.
    """
    rect = _window(cells, pointer)
    x0, y0, x1, y1 = rect
    window = cells[y0:y1, x0:x1]
    seed, starts = (
        _box_seed(cells, rect) if pointer.is_box else _click_seed(window, pointer, (x0, y0))
    )
    if seed is None:
        what = (
            "has no colour of its own: what is in it looks like what is around it"
            if pointer.is_box
            else "is on something grey"
        )
        raise CalibrationError(
            f"{pointer}: {what}; point at the paint itself, in better light if it is dark"
        )
    found = grow(window, seed, starts)
    # The seed was one place's; the patch's own colour is a better one.
    found = grow(window, np.median(window[found].tint, axis=0), found) if found.any() else found
    if np.count_nonzero(found) < MIN_CELLS:
        raise CalibrationError(
            f"{pointer}: only {4 * np.count_nonzero(found)} px of one colour are there; {4 * MIN_CELLS} px are needed"
        )
    if not pointer.is_box and _touches_border(found, rect, cells):
        raise CalibrationError(
            f"{pointer}: that colour goes on far beyond the click; is it the background, or a sleeve? Point at the paint itself"
        )
    mask = np.zeros(cells.shape, bool)
    mask[y0:y1, x0:x1] = found
    return Swatch(
        pointer.color,
        pointer.frame,
        mask,
        _core(mask),
        mask | _beyond(cells, rect, found) if pointer.is_box else mask,
    )


def _beyond(cells: Cells, rect: tuple[int, int, int, int], found: Mask) -> Mask:
    """What a patch in a box continues to outside, as boxes cut things.

    Nothing if it does not end within a box's size: the background.
    """
    height, width = cells.shape
    x0, y0, x1, y1 = rect
    wide = (
        max(x0 - (x1 - x0), 0),
        max(y0 - (y1 - y0), 0),
        min(2 * x1 - x0, width),
        min(2 * y1 - y0, height),
    )
    window = cells[wide[1] : wide[3], wide[0] : wide[2]]
    starts = np.zeros(window.shape, bool)
    starts[y0 - wide[1] : y1 - wide[1], x0 - wide[0] : x1 - wide[0]] = found
    more = grow(window, np.median(window[starts].tint, axis=0), starts)
    mask = np.zeros(cells.shape, bool)
    if not _touches_border(more, wide, cells):
        mask[wide[1] : wide[3], wide[0] : wide[2]] = more
    return mask


def _window(cells: Cells, pointer: Pointer) -> tuple[int, int, int, int]:
    """Cells in which to look; raises CalibrationError for places outside the picture."""
    height, width = cells.shape
    # Boxes may reach beyond the picture, as things at its edge do; their middle may not.
    x, y = pointer.x_px + pointer.width_px / 2.0, pointer.y_px + pointer.height_px / 2.0
    if not (0.0 <= x < 2 * width and 0.0 <= y < 2 * height):
        raise CalibrationError(
            f"{pointer}: lies outside the picture, which is {2 * width}x{2 * height} px"
        )
    if pointer.is_box:
        x0, y0 = max(int(pointer.x_px) // 2, 0), max(int(pointer.y_px) // 2, 0)
        x1 = min(int(np.ceil((pointer.x_px + pointer.width_px) / 2.0)), width)
        y1 = min(int(np.ceil((pointer.y_px + pointer.height_px) / 2.0)), height)
        if (x1 - x0) * (y1 - y0) < MIN_CELLS or min(pointer.width_px, pointer.height_px) < 2.0:
            raise CalibrationError(f"{pointer}: is too small; draw it around the whole marker")
        return x0, y0, x1, y1
    reach = int(max(16.0, _WINDOW * width))
    column, row = int(pointer.x_px) // 2, int(pointer.y_px) // 2
    return (
        max(column - reach, 0),
        max(row - reach, 0),
        min(column + reach + 1, width),
        min(row + reach + 1, height),
    )


def _click_seed(
    window: Cells, pointer: Pointer, origin: tuple[int, int]
) -> tuple[Array | None, Mask]:
    """Chroma over luma about a click, and the cells it was read from."""
    x, y = int(pointer.x_px) // 2 - origin[0], int(pointer.y_px) // 2 - origin[1]
    near = np.zeros(window.shape, bool)
    near[max(y - _REACH, 0) : y + _REACH + 1, max(x - _REACH, 0) : x + _REACH + 1] = True
    colored = near & (window.chroma >= MIN_CHROMA)
    middle = np.zeros(window.shape, bool)
    middle[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = True
    # The very middle, unless a highlight sits there.
    starts = colored & middle if np.count_nonzero(colored & middle) >= MIN_CELLS else colored
    if np.count_nonzero(starts) < MIN_CELLS:
        return None, starts
    return np.median(window[starts].tint, axis=0), starts


def _box_seed(cells: Cells, rect: tuple[int, int, int, int]) -> tuple[Array | None, Mask]:
    """The commonest chroma over luma in a box of the colours that are rarer around it, and the
    box's cells of those colours.

    Cells count the more the nearer they are to the middle, as people draw boxes around things.
    """
    x0, y0, x1, y1 = rect
    height, width = cells.shape
    w, h = x1 - x0, y1 - y0
    ring = np.zeros(cells.shape, bool)
    ring[max(y0 - h, 0) : min(y1 + h, height), max(x0 - w, 0) : min(x1 + w, width)] = True
    ring[y0:y1, x0:x1] = False
    box, outside = cells[y0:y1, x0:x1], cells[ring]
    rows, columns = np.mgrid[:h, :w]
    middle = np.exp(
        -4.0 * (((columns + 0.5) / w - 0.5) ** 2 + ((rows + 0.5) / h - 0.5) ** 2) / 0.25
    )
    weight = np.where(box.chroma >= MIN_CHROMA, middle, 0.0)
    inside = _histogram(box, weight / max(float(middle.sum()), 1e-9))
    around = _histogram(outside, (outside.chroma >= MIN_CHROMA) / max(float(outside.y.size), 1.0))
    own = np.where(inside > _OWN * around, inside, 0.0)
    peak = np.unravel_index(int(np.argmax(own)), own.shape)
    if own[peak] <= 0.0:
        return None, np.zeros((h, w), bool)
    turn, depth = _bins(box)
    apart = np.abs(turn - peak[0])
    starts = (
        (np.minimum(apart, _TURNS - apart) <= 1) & (np.abs(depth - peak[1]) <= 1) & (weight > 0.0)
    )
    if np.count_nonzero(starts) < MIN_CELLS:
        return None, starts
    return np.median(box[starts].tint, axis=0), starts


def _bins(cells: Cells) -> tuple[Array, Array]:
    """Bins of chroma over luma, which shade does not change: direction and, in half octaves,
    strength.
    """
    tint = cells.tint
    turn = (
        np.floor(np.arctan2(tint[..., 1], tint[..., 0]) * (_TURNS / (2.0 * np.pi))).astype(np.int64)
        % _TURNS
    )
    strength = np.hypot(tint[..., 0], tint[..., 1])
    depth = np.clip(
        np.floor(2.0 * np.log2(np.maximum(strength, 1e-6) / _WEAKEST)), 0, _DEPTHS - 1
    ).astype(np.int64)
    return turn, depth


def _histogram(cells: Cells, weight: Array) -> Array:
    """Sums of weights in bins, smoothed over neighbours; (_TURNS, _DEPTHS)."""
    turn, depth = _bins(cells)
    flat = np.bincount((turn * _DEPTHS + depth).ravel(), weight.ravel(), _TURNS * _DEPTHS).reshape(
        _TURNS, _DEPTHS
    )
    wrapped = np.concatenate([flat[-1:], flat, flat[:1]])
    return cv2.blur(wrapped, (3, 3), borderType=cv2.BORDER_CONSTANT)[1:-1]


def grow(window: Cells, tint: Array, starts: Mask) -> Mask:
    """Cells of like chroma over luma connected to any of the starts."""
    strength = float(np.hypot(*tint))
    if strength <= 0.0:
        return np.zeros(window.shape, bool)
    across, along = tint[::-1] * np.array([-1.0, 1.0]) / strength, tint / strength
    light = np.maximum(window.y, 1.0)
    side = np.abs(window.u * across[0] + window.v * across[1])
    depth = window.u * along[0] + window.v * along[1]
    expected = strength * light
    like = (
        (side <= _TURN * np.maximum(depth, 0.0) + _NOISE)
        & (depth >= _PALER * expected - _NOISE)
        & (depth <= _DEEPER * expected + _NOISE)
        & (window.chroma >= 0.5 * MIN_CHROMA)
    )
    _, labels = cv2.connectedComponents(like.astype(np.uint8), connectivity=4)
    hit, counts = np.unique(labels[starts & like], return_counts=True)
    return labels == hit[np.argmax(counts)] if len(hit) else np.zeros(window.shape, bool)


def _touches_border(found: Mask, rect: tuple[int, int, int, int], cells: Cells) -> bool:
    """Whether a grown patch ends at its window rather than by itself.

    The picture's own border may cut it.
    """
    height, width = cells.shape
    x0, y0, x1, y1 = rect
    return bool(
        (y0 > 0 and found[0].any())
        or (x0 > 0 and found[:, 0].any())
        or (y1 < height and found[-1].any())
        or (x1 < width and found[:, -1].any())
    )


def _core(mask: Mask) -> Mask:
    """The patch without its rim, whose cells are mixtures, if enough of it is left.

    Else all of it.
    """
    core = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    return (
        core if np.count_nonzero(core) >= max(4 * MIN_CELLS, 0.2 * np.count_nonzero(mask)) else mask
    )
