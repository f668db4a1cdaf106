"""Dots with a joint's name, picture after picture. Pure; pictures come in their order.

The tracker of dots (services/pi_tracker/dots) finds them and tells them apart; here seeds are
checked, and dots become places, or reasons why there is none.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from rhot.errors import CaptureError
from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import ColorTable, compile_colors
from services.pi_tracker.dots.dot import Dot, Patch
from services.pi_tracker.dots.finder import DotFinder
from services.pi_tracker.dots.tracker import DotTracker
from services.pi_tracker.identify.blob_shape import is_paint_shaped
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import picture
from studies.grasp.measure.dots.color import DOTS, color_about, color_at, no_dot, widened
from studies.grasp.measure.dots.ink import InkFinder, InkPatches
from studies.grasp.measure.joints import WRIST, Place, Seen
from studies.grasp.measure.seeds import Seeds

# Joints as OpenXR names them (rhot.hand.JOINTS), which is what the tracker of dots knows.
_BONE = {"mcp": "proximal", "pip": "intermediate", "dip": "distal", "tip": "tip"}
_THUMB_BONE = {"cmc": "metacarpal", "mp": "proximal", "ip": "distal", "tip": "tip"}
# A seed means the dot within so many of its diameters.
_SEED_DIAMETERS = 1.5
# Dots of one hand differ less in area than this.
_MUCH_LARGER = 6.0


class _Finder(Protocol):
    """Follows dots by the tracker's names."""

    def find(self, frame: Frame) -> dict[str, Dot]: ...


class DotJoints:
    """All dots of one recording."""

    def __init__(self, first: Frame, seeds: Seeds, color: ColorRange | None = None) -> None:
        """first: the first picture; color: the dots' range, found at the seeds if not given.

        Raises CaptureError naming a seed at which there is no dot.
        """
        named = {landmark_of(place): at for place, at in seeds.items()}
        self._names = {landmark_of(place): place for place in seeds}
        self._finder: _Finder
        found = _color(first, seeds, color)
        if found is None:
            ink = _ink(first, seeds)
            self._finder = InkFinder(ink, DotTracker(list(named), first.size_px, named))
        else:
            table = _table(found)
            self._finder = DotFinder(table, DOTS, Tracker(), list(named), first.size_px, named)
        self._size_px = first.size_px

    def find(self, frame: Frame) -> Seen:
        """The dots of the next picture."""
        dots = self._finder.find(frame)
        places: dict[str, Place] = {}
        lost: dict[str, str] = {}
        for landmark, place in self._names.items():
            dot = dots.get(landmark)
            if dot is None or dot.state == "carried":
                lost[place] = self._why(dot)
            else:
                places[place] = Place(dot.x_px, dot.y_px, dot.sigma_px, min(1.0, dot.quality))
        return Seen(frame.seq, 1e-9 * frame.stamp_ns, places, lost)

    def _why(self, dot: Dot | None) -> str:
        if dot is None:
            return "not found yet"
        width, height = self._size_px
        rim = math.sqrt(max(dot.area_px, 1.0) / math.pi)
        inside = rim <= dot.x_px <= width - rim and rim <= dot.y_px <= height - rim
        return "its dot is not seen" if inside else "out of view"


def landmark_of(place: str) -> str:
    """The tracker's name of a place; raises CaptureError of one that no dot can mark."""
    finger, joint = place.split("_", 1)
    bone = _THUMB_BONE.get(joint) if finger == "thumb" else _BONE.get(joint)
    if bone is None and joint == WRIST:
        bone = "metacarpal"
    if bone is None:
        raise CaptureError(
            f"seed {place}: marks a region of the edges method; with dots, the base line goes "
            f"through {finger}_{WRIST}, or is given by --base"
        )
    return f"{finger}_{bone}"


def _color(first: Frame, seeds: Seeds, given: ColorRange | None) -> ColorRange | None:
    """The dots' range, which takes one at every seed; None of dots without a colour.

    Raises CaptureError naming a seed at which there is no dot.
    """
    found = given or color_at(first, seeds)
    if found is not None:
        return _checked(first, seeds, found, given=given is not None)
    with contextlib.suppress(CaptureError):
        faint = color_about(first, seeds)
        areas = _areas(_patches(first, faint), seeds)
        if max(areas, default=np.inf) <= _MUCH_LARGER * min(areas, default=0.0):
            return _checked(first, seeds, faint, given=True)
    return None


def _table(color: ColorRange) -> ColorTable:
    return compile_colors(Colors(colors={DOTS: color}), [DOTS])


def _checked(first: Frame, seeds: Seeds, color: ColorRange, *, given: bool) -> ColorRange:
    """A range that takes a dot at every seed: as it is, or a little wider if it was not given.

    Raises CaptureError naming a seed at which there is none.
    """
    patches = _patches(first, color)
    if not patches:
        raise CaptureError(
            "no hand: there is not one dot of that colour in the first picture; see the colour "
            "(left out, it is found at the seeds)"
        )
    missed = _missed(patches, seeds)
    if not missed:
        return color
    if not given:
        areas = [patch.area_px for patch in patches]
        radius_px = math.sqrt(float(np.median(areas)) / math.pi)
        wider = widened(color, first, {place: seeds[place] for place in missed}, radius_px)
        more = _patches(first, wider)
        # Skin that the wider range takes, too, makes one large patch of what were dots.
        if not _missed(more, seeds) and max(_areas(more, seeds)) <= _MUCH_LARGER * min(areas):
            return wider
    place, distance_px = next(iter(missed.items()))
    raise no_dot(place, seeds, f"the nearest one is {distance_px:.0f} px away")


def _ink(first: Frame, seeds: Seeds) -> InkPatches:
    """Dots without a colour; raises CaptureError where there are none either."""
    ink = InkPatches(first, seeds)
    patches = ink.find(first) if ink.stands_out else []
    if not patches:
        raise CaptureError(
            "no dots at the seeds: what is there has no colour of its own and is neither darker "
            "nor lighter than what is around; point at the middle of each dot, or measure a "
            "finger without dots by --method edges"
        )
    for place, distance_px in _missed(patches, seeds).items():
        raise no_dot(place, seeds, f"the nearest one is {distance_px:.0f} px away")
    return ink


def _patches(frame: Frame, color: ColorRange) -> list[Patch]:
    """What has that colour, roughly measured."""
    settings, image = Tracker(), picture(frame)
    blobs = BlobDetector(_table(color), settings).detect(image, (0, 0, *image.size))
    return [
        Patch(blob.x_px, blob.y_px, blob.area_px)
        for blob in blobs
        if is_paint_shaped(blob, settings.max_area_px)
    ]


def _missed(patches: Sequence[Patch], seeds: Seeds) -> dict[str, float]:
    """Seeds without a patch, and how far the nearest one is; raises CaptureError of two at one."""
    taken: dict[int, str] = {}
    missed: dict[str, float] = {}
    for place, (x, y) in seeds.items():
        apart = [math.hypot(one.x_px - x, one.y_px - y) for one in patches]
        nearest = min(range(len(patches)), key=apart.__getitem__)
        diameter_px = 2.0 * math.sqrt(patches[nearest].area_px / math.pi)
        if apart[nearest] > _SEED_DIAMETERS * diameter_px:
            missed[place] = apart[nearest]
        elif nearest in taken:
            raise CaptureError(
                f"seeds {taken[nearest]} and {place}: are on the same dot; each joint has its own"
            )
        else:
            taken[nearest] = place
    return missed


def _areas(patches: Sequence[Patch], seeds: Seeds) -> list[float]:
    """The area of the patch nearest to each seed, px^2."""
    if not patches:
        return []
    return [
        min(patches, key=lambda one: math.hypot(one.x_px - x, one.y_px - y)).area_px
        for x, y in seeds.values()
    ]
