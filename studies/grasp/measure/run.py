"""From pictures and seeds to what was seen in each picture. Pure but for reading the pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from typing import Protocol

from rhot.files.calibration import ColorRange
from services.pi_tracker.image.frame import Frame
from studies.grasp.measure.dots.finder import DotJoints
from studies.grasp.measure.edges.finder import EdgeFinder
from studies.grasp.measure.edges.paper import PaperFinder
from studies.grasp.measure.flat import Flat, flat_about
from studies.grasp.measure.gaps import bridged
from studies.grasp.measure.joints import Place, Seen, fingers_in
from studies.grasp.measure.pictures import Pictures, corrected_seeds
from studies.grasp.measure.seeds import Method, Seeds, check_seeds
from studies.grasp.metrology.plane import Plane


class Finder(Protocol):
    """Finds joints, picture after picture."""

    def find(self, frame: Frame) -> Seen: ...


def see(
    pictures: Pictures,
    seeds: Seeds,
    method: Method,
    color: ColorRange | None,
    advance: Callable[[], None],
    plane: Plane | None = None,
) -> list[Seen]:
    """What every picture shows. seeds: px of the first picture as the camera saw it; plane: the
    finger's, where a reference says it: an outline's bones are rigid only straight from the front.

    advance is called after each. Raises CaptureError of seeds or pictures that will not do.
    """
    frames = _checked(pictures, seeds, method, advance)
    first = next(frames, None)
    if first is None:
        return []
    corrected = corrected_seeds(seeds, pictures.lens)
    whole = chain([first], frames)
    if method == "edges":
        return _by_outline(whole, corrected, plane)
    finders = _finders(first, corrected, method, color)
    seen = [_together([finder.find(frame) for finder in finders]) for frame in whole]
    return bridged(seen) if method == "dots" else seen


def _checked(
    pictures: Pictures, seeds: Seeds, method: Method, advance: Callable[[], None]
) -> Iterator[Frame]:
    """The frames, counted; seeds are checked with the first."""
    for number, frame in enumerate(pictures.frames()):
        if number == 0:
            check_seeds(seeds, frame.size_px, method)
        yield frame
        advance()


def _by_outline(frames: Iterable[Frame], seeds: Seeds, plane: Plane | None) -> list[Seen]:
    """What all pictures together show."""
    flat: Flat | None = None
    finders: list[EdgeFinder] = []
    for frame in frames:
        if not finders:
            flat = None if plane is None else flat_about(plane, seeds, frame.size_px)
            at = seeds if flat is None else flat.seeds(seeds)
            finders = [EdgeFinder(finger, at) for finger in fingers_in(list(seeds))]
        front = frame if flat is None else flat.frame(frame)
        for finder in finders:
            finder.look(front)
    seen = [_together(one) for one in zip(*(finder.seen() for finder in finders), strict=True)]
    return seen if flat is None else [flat.back(one) for one in seen]


def _finders(first: Frame, seeds: Seeds, method: Method, color: ColorRange | None) -> list[Finder]:
    if method == "dots":
        return [DotJoints(first, seeds, color)]
    return [PaperFinder(finger, seeds) for finger in fingers_in(list(seeds))]


def _together(seen: Sequence[Seen]) -> Seen:
    """One picture, as several finders saw it."""
    places: dict[str, Place] = {}
    lost: dict[str, str] = {}
    for one in seen:
        places.update(one.places)
        lost.update(one.lost)
    notes = tuple(note for one in seen for note in one.notes)
    return Seen(seen[0].frame, seen[0].time_s, places, lost, notes)
