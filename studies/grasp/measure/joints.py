"""What a joint is called, where it was seen, and which joints make a finger. Pure.

A place is called <finger>_<joint>, as index_pip. A recording has three bones and the joints of a
finger: the thumb's CMC, MCP (here mp) and IP joints are its `mcp`, `pip` and `dip` there.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from studies.grasp.recording import Angle, Joint

Finger = Literal["index", "middle", "ring", "little", "thumb"]
FINGERS: tuple[Finger, ...] = ("index", "middle", "ring", "little", "thumb")
# The joints that bend.
BENDING: tuple[Angle, ...] = ("mcp", "pip", "dip")
# In the order of the finger: the joint's name in a recording, and in a place's name.
_JOINTS: dict[Joint, str] = {"mcp": "mcp", "pip": "pip", "dip": "dip", "tip": "tip"}
_THUMB_JOINTS: dict[Joint, str] = {"mcp": "cmc", "pip": "mp", "dip": "ip", "tip": "tip"}
# Places on the back of the hand that a base line may go through: the paper's regions B1 and B2, the
# wrist (or any dot on the metacarpal), the thumb's CMC joint.
B1, B2, WRIST, THUMB_CMC = "b1", "b2", "wrist", "thumb_cmc"


class Place(NamedTuple):
    """Where something was seen: px of the corrected picture, pixel (0, 0) a pixel's centre.

    sigma_px is one standard deviation of each coordinate; quality is 0..1.
    """

    x_px: float
    y_px: float
    sigma_px: float
    quality: float = 1.0


class Seen(NamedTuple):
    """One picture: its number and instant, the places that were seen, and why others were not;
    notes (place, what is to be known of it) hold for all pictures and stand in the first.
    """

    frame: int
    time_s: float
    places: dict[str, Place]
    lost: dict[str, str]
    notes: tuple[tuple[str, str], ...] = ()


def joints_of(finger: Finger) -> dict[Joint, str]:
    """The finger's joints in their order: name in a recording -> name of the place."""
    joints = _THUMB_JOINTS if finger == "thumb" else _JOINTS
    return {joint: f"{finger}_{own}" for joint, own in joints.items()}


def base_places(finger: Finger) -> tuple[tuple[str, str], ...]:
    """Pairs of places through which its base line may go, the best first; towards the finger.

    The metacarpal's own two regions; wrist and knuckle; at last from the thumb's CMC joint, which
    lies at the wrist's thumb side, to the knuckle. The thumb has the index finger's.
    """
    finger = "index" if finger == "thumb" else finger
    knuckle = f"{finger}_mcp"
    return (
        (f"{finger}_{B1}", f"{finger}_{B2}"),
        (f"{finger}_{WRIST}", knuckle),
        (THUMB_CMC, knuckle),
    )


def all_places(finger: Finger) -> list[str]:
    """Every name that a place of this finger may have."""
    own = list(joints_of(finger).values())
    if finger == "thumb":
        return own
    return [f"{finger}_{name}" for name in (WRIST, B1, B2)] + own


def fingers_in(places: list[str]) -> list[Finger]:
    """The fingers of which a joint is among the places, in the order of the hand.

    The thumb's CMC joint alone is no thumb: it may be there for the index finger's base line.
    """
    return [one for one in FINGERS if (set(places) & set(joints_of(one).values())) - {THUMB_CMC}]
