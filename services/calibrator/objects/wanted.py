"""Which trackers are registered by which paint; where objects sit on them. From options. Pure."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import ObjectPlace, Row3, Row4
from rhot.files.config import RigConfig
from rhot.geometry.transforms import (
    quaternion_from_rotation,
    rotation_x,
    rotation_y,
    rotation_z,
)

# An object's origin farther from its tracker, m, is a mistake of units.
_MAX_OFFSET_M = 3.0


class Painted(NamedTuple):
    """One object whose tracker carries paint."""

    name: str
    serial: str
    color: str


class Place(NamedTuple):
    """What options say of where an object sits on its tracker; None where they do not."""

    offset_m: Row3 | None = None
    orientation_wxyz: Row4 | None = None

    def on(self, place: ObjectPlace) -> ObjectPlace:
        """The place with what the options say."""
        return ObjectPlace(
            offset_m=place.offset_m if self.offset_m is None else self.offset_m,
            orientation_wxyz=(
                place.orientation_wxyz if self.orientation_wxyz is None else self.orientation_wxyz
            ),
            time_offset_ns=place.time_offset_ns,
            marker_m=place.marker_m,
        )


def painted_objects(config: RigConfig, names: list[str], marker: str | None) -> list[Painted]:
    """The objects to register; all whose tracker has paint if none is named.

    marker is the colour of the paint instead of rig.toml's. Raises CalibrationError naming what is
    valid.
    """
    known = {table.name: table for table in config.object}
    if not known:
        raise CalibrationError(
            "rig.toml has no [[object]] table; add one with its tracker's serial"
        )
    for name in names:
        check_name(config, name)
    tables = [known[name] for name in names] if names else list(known.values())
    if marker:
        if len(tables) > 1:
            raise CalibrationError(
                f"--marker {marker} is on one tracker: say of which object, one of "
                f"{', '.join(known)}"
            )
        return [Painted(tables[0].name, tables[0].serial, marker)]
    found = [Painted(one.name, one.serial, one.marker) for one in tables if one.marker]
    unpainted = [one.name for one in tables if not one.marker]
    if unpainted and (names or not found):
        raise CalibrationError(
            f"the tracker of {', '.join(unpainted)} has no paint: write its colour into rig.toml "
            f'([[object]] marker = "orange"), or give --marker'
        )
    return found


def note_on_colors(config: RigConfig, painted: Iterable[Painted]) -> list[str]:
    """What a person should know of colours that the hands have too."""
    of_hands = {
        color: f"the {hand} hand's {landmark.replace('_', ' ')}"
        for hand, table in config.hand.items()
        for landmark, color in table.markers.items()
    }
    return [
        f"{one.color} is also {of_hands[one.color]}: keep the painted hand out of every picture, "
        "and paint the tracker with it, or hold a dab of it to the tracker"
        for one in painted
        if one.color in of_hands
    ]


def places_of(
    config: RigConfig, names: list[str], offsets: list[str], turns: list[str]
) -> dict[str, Place]:
    """What --offset and --turn say, by object.

    Without a name they are of the only object that is named, or that there is.
    """
    places: dict[str, Place] = {}
    for text in offsets:
        name, offset = _triple(config, names, text, "--offset", "metres, e.g. cup=0,0.02,-0.05")
        if np.linalg.norm(offset) > _MAX_OFFSET_M:
            raise CalibrationError(
                f"--offset {text!r}: is {np.linalg.norm(offset):g} m; give metres, as 0,0.02,-0.05"
            )
        places[name] = places.get(name, Place())._replace(offset_m=offset)
    for text in turns:
        name, turn = _triple(config, names, text, "--turn", "degrees, e.g. cup=90,0,0")
        x, y, z = np.deg2rad(turn)
        w, *xyz = quaternion_from_rotation(rotation_z(z) @ rotation_y(y) @ rotation_x(x)).tolist()
        orientation = (round(w, 9), *(round(value, 9) for value in xyz))
        places[name] = places.get(name, Place())._replace(orientation_wxyz=orientation)
    return places


def check_name(config: RigConfig, name: str) -> None:
    """Raises CalibrationError if rig.toml has no such object."""
    known = [table.name for table in config.object]
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise CalibrationError(
            f"rig.toml has no object {name!r}; {hint}It has: {', '.join(known) or 'none'}"
        )


def _triple(
    config: RigConfig, names: list[str], text: str, option: str, example: str
) -> tuple[str, Row3]:
    """[NAME=]X,Y,Z"""
    name, equals, rest = text.rpartition("=")
    try:
        numbers = [float(part) for part in rest.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not np.all(np.isfinite(numbers)):
        raise CalibrationError(f"{option} {text!r}: give [NAME=]X,Y,Z in {example}")
    if equals:
        check_name(config, name)
        return name, (numbers[0], numbers[1], numbers[2])
    candidates = names or [table.name for table in config.object]
    if len(candidates) != 1:
        raise CalibrationError(
            f"{option} {text!r}: say of which object, e.g. {candidates[0]}={rest}"
            if candidates
            else f"{option} {text!r}: rig.toml has no [[object]] table"
        )
    return candidates[0], (numbers[0], numbers[1], numbers[2])


def same_place(places: Mapping[str, ObjectPlace], names: Iterable[str]) -> list[str]:
    """Names of objects whose origin is still their tracker's."""
    neutral = ObjectPlace()
    return [
        name
        for name in names
        if (found := places.get(name, neutral)).offset_m == neutral.offset_m
        and found.orientation_wxyz == neutral.orientation_wxyz
    ]
