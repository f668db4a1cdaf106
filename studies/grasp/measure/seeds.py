"""Where the joints are in the first picture, as a person says it: `index_tip=512,300`. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Literal

import msgspec

from rhot.errors import UNDECODABLE, CaptureError
from studies.grasp.measure.joints import (
    B1,
    B2,
    FINGERS,
    WRIST,
    all_places,
    base_places,
    fingers_in,
    joints_of,
)

Seeds = dict[str, tuple[float, float]]
# Other names of a place. Without a finger it is the index finger's, the study's.
_ALIASES = {
    **{joint: f"index_{joint}" for joint in ("mcp", "pip", "dip", "tip", "b1", "b2", "wrist")},
    "base": "index_wrist",
    "index_base": "index_wrist",
    "thumb_mcp": "thumb_mp",
}
Method = Literal["dots", "edges", "edges-paper"]
# Where B2 lies on the way from wrist to knuckle: before the knuckle's own swelling.
_B2_SHARE = 0.8
_SEED = re.compile(r"(?P<place>\w+)=(?P<x>-?[\d.]+),(?P<y>-?[\d.]+)")
_EXAMPLE = "--seed index_mcp=410,352 --seed index_pip=512,300"


def parse_seeds(texts: Iterable[str]) -> Seeds:
    """Seeds of the command line; px of the picture as the camera saw it."""
    seeds: Seeds = {}
    for text in texts:
        found = _SEED.fullmatch(text.replace(" ", ""))
        try:
            at = (float(found["x"]), float(found["y"])) if found else None
        except ValueError:
            at = None
        if found is None or at is None:
            raise CaptureError(f"--seed {text}: is not joint=x,y in pixels, as in {_EXAMPLE}")
        if found["place"] in seeds:
            raise CaptureError(f"--seed {found['place']}: is given twice; each joint once")
        seeds[found["place"]] = at
    return _known(seeds)


def parse_line(text: str) -> Seeds:
    """A base line of the command line, its two ends by name."""
    try:
        x0, y0, x1, y1 = (float(part) for part in text.split(","))
    except ValueError:
        raise CaptureError(
            f"--base {text}: is not x1,y1,x2,y2, two pixels from the wrist towards the finger"
        ) from None
    if (x0, y0) == (x1, y1):
        raise CaptureError(f"--base {text}: its two points are the same")
    return {"base_start": (x0, y0), "base_end": (x1, y1)}


def decode_seeds(content: bytes, name: str) -> Seeds:
    """Seeds of a file: {"index_tip": [512, 300], ...}; name is for the error."""
    try:
        return _known(msgspec.json.decode(content, type=Seeds))
    except UNDECODABLE as error:
        raise CaptureError(
            f'{name}: holds no seeds ({error}); it should be {{"index_tip": [512, 300], ...}}'
        ) from None


def for_method(seeds: Seeds, method: Method) -> Seeds:
    """The same seeds; for edges, regions B1 and B2 on the line from wrist to knuckle.

    Where no b1 and b2 are given but a wrist: the back of the hand lies along that line.
    """
    result = dict(seeds)
    if method == "dots":
        return result
    for finger in FINGERS:
        b1, b2, wrist, knuckle = (f"{finger}_{name}" for name in (B1, B2, WRIST, "mcp"))
        if wrist in result and not {b1, b2} <= set(result) and knuckle in result:
            (x0, y0), (x1, y1) = result[wrist], result[knuckle]
            result[b1] = (x0, y0)
            result[b2] = (x0 + _B2_SHARE * (x1 - x0), y0 + _B2_SHARE * (y1 - y0))
            del result[wrist]
    return result


def _known(given: Seeds) -> Seeds:
    seeds = {_ALIASES.get(place, place): at for place, at in given.items()}
    valid = [place for finger in FINGERS for place in all_places(finger)]
    for place in seeds:
        if place not in valid:
            near = [one for one in valid if one.split("_")[0] == place.split("_")[0]] or valid
            raise CaptureError(f"seed {place}: there is no such joint; valid: {', '.join(near)}")
    return seeds


def check_seeds(seeds: Seeds, size_px: tuple[int, int], method: Method) -> None:
    """Whether they lie in the picture and a finger can be measured with them.

    Raises CaptureError naming what is missing.
    """
    if not seeds:
        raise CaptureError(
            "no seeds: say where each joint is in the first picture, as in "
            f"{_EXAMPLE}, or with --seeds FILE.json"
        )
    width, height = size_px
    for place, (x, y) in seeds.items():
        if not (0 <= x < width and 0 <= y < height):
            raise CaptureError(
                f"seed {place}={x:g},{y:g}: lies outside the picture, which is {width}x{height} px"
            )
    fingers = fingers_in(list(seeds))
    if not fingers:
        raise CaptureError(f"seeds {', '.join(seeds)}: are of no finger's joints")
    for finger in fingers:
        wanted = list(joints_of(finger).values())
        missing = [place for place in wanted if place not in seeds]
        # By dots, each dot stands by itself; edges are one finger's outline from knuckle to tip.
        if len(missing) > (len(wanted) - 2 if method == "dots" else 0):
            raise CaptureError(
                f"seeds missing for {', '.join(missing)}: the {finger} finger needs "
                f"{', '.join(wanted)}" + (", or two of them" if method == "dots" else "")
            )


def missing_notes(seeds: Seeds, *, has_base: bool) -> dict[str, list[str]]:
    """What the seeds leave out and what that costs, by finger."""
    notes: dict[str, list[str]] = {}
    for finger in fingers_in(list(seeds)):
        missing = [place for place in joints_of(finger).values() if place not in seeds]
        notes[finger] = [f"no seed for {place}: what needs it is left out" for place in missing]
        pairs = base_places(finger)
        if not has_base and not any(set(pair) <= set(seeds) for pair in pairs):
            ways = " or ".join(" and ".join(pair) for pair in pairs)
            notes[finger].append(
                "no base line: the MCP angle and positions in the finger's plane are left out; "
                f"give --base x1,y1,x2,y2, or seeds of {ways}"
            )
    return notes
