"""What an object's state means, in the words of the page, `rhot top` and `rhot doctor`. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from rhot.messages.objects import ObjectTracking

# By ObjectTracking: what an object is said to be; each reads on after "cup: ".
WORDS: dict[str, str] = {
    "ok": "tracked",
    "out_of_range": "out of the lighthouses' view",
    "rotation_only": "its turn is known, its place is not",
    "calibrating": "its tracker is locating itself",
    "lost": "lost",
    "unregistered": "not registered to the rig",
}
# What one can do about it, or see by it.
ADVICE: dict[str, str] = {
    "ok": "",
    "out_of_range": "turn its tracker to a lighthouse, or move it back between them",
    "rotation_only": "wait, in view of a lighthouse; a shiny surface nearby also does this",
    "calibrating": "hold it still for some seconds in view of the lighthouses",
    "lost": "is its tracker on, and in view of a lighthouse?",
    "unregistered": "run `rhot calibrate objects`",
}


def state_of(tracking: ObjectTracking, registered: bool) -> ObjectTracking:
    """What hinders most: a pose in the lighthouse's frame is no pose in the rig, however good."""
    return tracking if registered or tracking == "lost" else "unregistered"


def holding(hand: str, name: str, parts: Sequence[str]) -> str:
    """`right hand holds cup (thumb, index)`."""
    return f"{hand} hand holds {name} ({', '.join(parts)})"


def touching(hand: str, name: str, parts: Sequence[str]) -> str:
    """`right hand touches cup (index)`."""
    return f"{hand} hand touches {name} ({', '.join(parts)})"
