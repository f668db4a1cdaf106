"""Rules of one table of rig.toml that none of its keys alone can say: each tells what is wrong, and
None if nothing is.
"""

from __future__ import annotations

import difflib
from collections import Counter

from rhot.files.rig_tables import HandTable, ObjectTable
from rhot.hand import LANDMARKS


def joints_problem(table: HandTable) -> str | None:
    """What is wrong with a hand's joints and fingers together; None if nothing is."""
    if table.fingers and not table.joints:
        return 'has fingers, but no joints; write joints = "red", or name each dot in markers'
    twice = sorted({name for name in table.fingers if table.fingers.count(name) > 1})
    return f"fingers has {twice[0]!r} twice" if twice else None


def sharing_problem(table: HandTable) -> str | None:
    """What is wrong with landmarks of a hand that have one colour; None if nothing is."""
    wearers = Counter(table.markers.values())
    for landmark, color in table.markers.items():
        if wearers[color] > 1 and landmark in ("palm", "wrist"):
            return (
                f"colour {color!r} is used twice, once for {landmark}; only joints of fingers can "
                "share one"
            )
    return None


def markers_problem(table: HandTable) -> str | None:
    """What is wrong with a hand's markers, its joints written out among them."""
    for landmark in table.markers:
        if landmark not in LANDMARKS:
            near = difflib.get_close_matches(landmark, LANDMARKS, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            return f"unknown landmark {landmark!r}; {hint}Valid: {', '.join(LANDMARKS)}"
    if not table.markers:
        return 'is empty; name at least one landmark, e.g. index_tip = "blue"'
    return sharing_problem(table)


# How many lengths size_m has, and what they are.
_SIZES = {
    "box": (3, "[x, y, z]"),
    "cylinder": (2, "[diameter, height along y]"),
    "sphere": (1, "[diameter]"),
}


def shape_problem(item: ObjectTable) -> str | None:
    """What is wrong with an object's shape, size_m and mesh together; None if nothing is."""
    if item.mesh and item.shape != "mesh":
        return f'has mesh = {item.mesh!r} and shape = {item.shape!r}; write shape = "mesh"'
    if item.shape == "mesh" and not item.mesh:
        return 'shape = "mesh" needs mesh = "FILE.glb" (or .stl), relative to rig.toml'
    count, meaning = _SIZES.get(item.shape, (0, "nothing"))
    if len(item.size_m) != count:
        kind = f"shape = {item.shape!r}" if item.shape else "no shape"
        return (
            f"size_m has {len(item.size_m)} lengths; with {kind} it has {count}: {meaning}"
            if count
            else f"size_m has {len(item.size_m)} lengths; with {kind} there are none"
        )
    return None
