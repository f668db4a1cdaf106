"""Names of paints by their hue, and which further paints would stand out best. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from services.pi_tracker.dots.assignment import assign
from services.pi_tracker.image.chroma import Cells, Mask
from services.pi_tracker.image.hue import Array, hue_difference

# Middle hues of acrylic paints by the names people give them, OpenCV 0..180: of colour charts, and
# of the simulator's paints.
PAINT_HUES: dict[str, float] = {
    "red": 0.0,
    "orange": 11.0,
    "yellow": 25.0,
    "lime": 39.0,
    "green": 66.0,
    "cyan": 92.0,
    "blue": 112.0,
    "violet": 134.0,
    "magenta": 161.0,
}
# With names that only a rig.toml gives: between two usual paints, for a seventh one.
NAMED_HUES = PAINT_HUES | {"leaf": 53.0}
# A name is not given to a hue further from it than this; to one that is paint for sure, than that.
_MAX_NAME_DISTANCE, _MAX_PAINT_DISTANCE = 16.0, 21.0
# A marker's patch is at least this saturated and this bright, and stands out from the cells around
# it.
_MIN_SATURATION, _MIN_VALUE = 55.0, 35.0
# Hues nearer than this to another paint, to skin or to much of the room are not suggested.
_MIN_CLEARANCE = 12.0
# Skin of any complexion in white light has OpenCV hues of 3 to 20.
_SKIN_HUES = (4.0, 12.0, 19.0)
# Bins of the room's hues, and the share of a picture's cells that a bin must hold to count.
_BIN_HUES, _MIN_ROOM_SHARE = 5, 0.003
# Gains of each patch by each name (n, m), 0 where it cannot be, and the names -> each one's name by
# its index, -1 for none.
Choose = Callable[[Array, Sequence[str]], list[int]]


@dataclass(frozen=True)
class Suggestion:
    """A paint that is not in the pictures yet.

    clearance is its distance in hue from skin, room and the paints in use.
    """

    color: str
    clearance: float


def with_most_gain(gains: Array, _names: Sequence[str]) -> list[int]:
    """Names by their hues alone."""
    return assign(gains).tolist()


def paint_names(
    hues: Sequence[float],
    preferred: Sequence[str],
    taken: set[str],
    *,
    weights: Sequence[float] = (),
    surely_paint: bool = False,
    choose: Choose = with_most_gain,
) -> list[str]:
    """A name for each hue, none of them taken: of the preferred ones (rig.toml's colours) as many
    as fit, as near as they can be, then the nearest of the others.

    A hue no name is near to gets its number. weights: how much each counts, 0..1, where several
    want one name. surely_paint: coloured light may have turned it by more, towards another of the
    preferred colours. choose: who gets which name, by what it gains.
    """
    weight = np.array(weights or [1.0] * len(hues), dtype=np.float64).reshape(-1, 1)
    found = [f"hue{round(hue) % 180}" for hue in hues]
    unnamed = np.ones((len(hues), 1), bool)
    rig = [name for name in preferred if name in NAMED_HUES]
    rest = [name for name in PAINT_HUES if name not in rig]
    from_rig, from_rest = _distances(hues, rig), _distances(hues, rest)
    fits = from_rig <= _MAX_NAME_DISTANCE
    if surely_paint:
        nearest_other = from_rest.min(axis=1, initial=90.0, keepdims=True)
        fits |= from_rig <= np.minimum(nearest_other, _MAX_PAINT_DISTANCE)
    for names, apart, allowed in (
        (rig, from_rig, fits),
        (rest, from_rest, from_rest <= _MAX_NAME_DISTANCE),
    ):
        free = np.array([name not in taken for name in names], bool)
        # One name more counts more than how near they are.
        gains = np.where(allowed & free & unnamed, weight * (60.0 - apart), 0.0)
        for n, column in enumerate(choose(gains, names)):
            if column >= 0:
                found[n], unnamed[n] = names[column], False
    return found


def _distances(hues: Sequence[float], names: Sequence[str]) -> Array:
    """Of hues (n,) from those of m names; (n, m)."""
    rows = [[abs(hue_difference(hue, NAMED_HUES[name])) for name in names] for hue in hues]
    return np.array(rows, dtype=np.float64).reshape(len(hues), len(names))


def suggest(cells: Sequence[Cells], used_hues: Sequence[float]) -> list[Suggestion]:
    """Paints whose hue is clear of skin, of much of the room and of the hues in use.

    Clearest first.
    """
    avoided = [*used_hues, *_SKIN_HUES, *_room_hues(cells)]
    found = []
    for name, hue in PAINT_HUES.items():
        clearance = min((abs(hue_difference(hue, other)) for other in avoided), default=90.0)
        if clearance >= _MIN_CLEARANCE:
            found.append(Suggestion(name, round(clearance, 1)))
    return sorted(found, key=lambda suggestion: -suggestion.clearance)


def _room_hues(cells: Sequence[Cells]) -> list[float]:
    """Hues of which the pictures hold much."""
    bins = 180 // _BIN_HUES
    share = np.zeros(bins)
    for part in cells:
        hue, saturation, value = part.hsv()
        vivid = hue[vivid_mask(saturation, value)]
        counts = np.bincount((vivid // _BIN_HUES).astype(np.int64) % bins, minlength=bins)
        share += counts / part.y.size
    much = np.nonzero(share / max(len(cells), 1) >= _MIN_ROOM_SHARE)[0].tolist()
    return [_BIN_HUES * number + _BIN_HUES / 2.0 for number in much]


def vivid_mask(saturation: Array, value: Array) -> Mask:
    """Which cells are saturated and bright enough to be paint."""
    return (saturation >= _MIN_SATURATION) & (value >= _MIN_VALUE)
