"""From pictures and seeds to what was seen in each picture. Pure but for reading the pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from rhot.files.calibration import ColorRange
from services.pi_tracker.image.frame import Frame
from studies.grasp.measure.dots.finder import DotJoints
from studies.grasp.measure.edges.finder import EdgeFinder
from studies.grasp.measure.gaps import bridged
from studies.grasp.measure.joints import Place, Seen, fingers_in
from studies.grasp.measure.pictures import Pictures, corrected_seeds
from studies.grasp.measure.seeds import Method, Seeds, check_seeds


class Finder(Protocol):
    """Finds joints, picture after picture."""

    def find(self, frame: Frame) -> Seen: ...


def see(
    pictures: Pictures,
    seeds: Seeds,
    method: Method,
    color: ColorRange | None,
    advance: Callable[[], None],
) -> list[Seen]:
    """What every picture shows. seeds: px of the first picture as the camera saw it.

    advance is called after each. Raises CaptureError of seeds or pictures that will not do.
    """
    finders: list[Finder] = []
    seen: list[Seen] = []
    for frame in pictures.frames():
        if not finders:
            check_seeds(seeds, frame.size_px, method)
            corrected = corrected_seeds(seeds, pictures.lens)
            finders = _finders(frame, corrected, method, color)
        seen.append(_together([finder.find(frame) for finder in finders]))
        advance()
    return bridged(seen) if method == "dots" else seen


def _finders(first: Frame, seeds: Seeds, method: Method, color: ColorRange | None) -> list[Finder]:
    if method == "dots":
        return [DotJoints(first, seeds, color)]
    return [
        EdgeFinder(finger, seeds, paper=method == "edges-paper")
        for finger in fingers_in(list(seeds))
    ]


def _together(seen: Sequence[Seen]) -> Seen:
    """One picture, as several finders saw it."""
    places: dict[str, Place] = {}
    lost: dict[str, str] = {}
    for one in seen:
        places.update(one.places)
        lost.update(one.lost)
    return Seen(seen[0].frame, seen[0].time_s, places, lost)
