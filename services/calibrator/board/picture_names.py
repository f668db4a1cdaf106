"""Names of picture files: which part of them is the camera, and which the board position. Pure.

A name is read as a list of parts: its folders, then the words and numbers of the file's name. One
place in that list is the camera, all others together are the position.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

# Pictures by camera, then by the key of the board position.
Files = dict[str, dict[str, Path]]
# A file, and the parts of its name.
Named = tuple[Path, list[str]]

_PART = re.compile(r"[A-Za-z]+|\d+")
# What a camera may be called: its name becomes part of file names and of topics.
_CAMERA_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")
# More cameras than this are never one rig here: the varying part is then the number of the picture.
_MAX_CAMERAS = 16


@dataclass(frozen=True)
class Reading:
    """One way to read the names, and whether only a number tells the cameras apart."""

    files: Files
    numbered: bool

    @property
    def rank(self) -> tuple[int, int, int]:
        """How much speaks for this reading, the larger the more.

        Positions all cameras share, then names rather than numbers, then few cameras.
        """
        shared = set.intersection(*(set(pictures) for pictures in self.files.values()))
        return len(shared) * len(self.files), 0 if self.numbered else 1, -len(self.files)


def name_parts(path: Path) -> list[str]:
    """The folders of a path as they are, then the words and numbers of the file's name."""
    return [*path.parts[:-1], *_PART.findall(path.stem)]


def read_names(files: list[Path], folder: Path, cameras: list[str] | None = None) -> Reading | None:
    """The best reading of the files' names below the folder; None if none tells cameras apart.

    `cameras` are the names to expect, if they are known.
    """
    groups: dict[tuple[str, ...], list[Named]] = defaultdict(list)
    for path in files:
        parts = name_parts(path.relative_to(folder))
        groups[_shape(parts)].append((path, parts))
    return _best([_read_group(group, cameras) for group in groups.values()])


def _best(readings: list[Reading | None]) -> Reading | None:
    """The reading of the highest rank; on a draw the earlier one."""
    found = [reading for reading in readings if reading is not None]
    return max(found, key=lambda reading: reading.rank) if found else None


def _shape(parts: list[str]) -> tuple[str, ...]:
    """What names of one series have in common: how many parts, and which of them are numbers."""
    return tuple("9" if part.isdigit() else "a" for part in parts)


def _read_group(group: list[Named], cameras: list[str] | None) -> Reading | None:
    """The best reading of names of one shape, each part tried as the camera."""
    readings = []
    for place in range(len(group[0][1])):
        values = Counter(parts[place] for _, parts in group)
        if cameras and not set(cameras) <= set(values):
            continue
        if not cameras and not 2 <= len(values) <= _MAX_CAMERAS:
            continue
        readings.append(_read_place(group, place, cameras))
    # Names rank above numbers: 1_left, 1_right.
    return _best(readings)


def _read_place(group: list[Named], place: int, cameras: list[str] | None) -> Reading | None:
    """The names read with the part at `place` as the camera; None if that cannot be."""
    files: Files = defaultdict(dict)
    for path, parts in group:
        key = _position_key(parts, place)
        if key in files[parts[place]]:
            return None
        files[parts[place]][key] = path
    named = {
        _camera_name(group, place, value): pictures
        for value, pictures in files.items()
        if cameras is None or value in cameras
    }
    if len(named) < 2 or not all(_CAMERA_NAME.match(name) for name in named):
        return None
    # One picture of each is a series of one camera, or pictures side by side, whose numbers are
    # positions.
    if len(group) > 2 and all(len(pictures) == 1 for pictures in named.values()):
        return None
    order = cameras or sorted(named, key=lambda name: (_side(name), natural_key(name)))
    return Reading({name: named[name] for name in order}, all(value.isdigit() for value in files))


def _position_key(parts: list[str], place: int) -> str:
    """The key of the board position: all parts but the camera's.

    A camera's name may be repeated, as in left/left01.png, and its partner's number may have other
    leading zeros.
    """
    others = [
        part
        for part in parts[:place] + parts[place + 1 :]
        if part != parts[place] or part.isdigit()
    ]
    return "-".join(str(int(part)) if part.isdigit() else part for part in others) or "0"


def _camera_name(group: list[Named], place: int, value: str) -> str:
    """The camera's name: a bare number takes the letters before it along (`cam` + `0`)."""
    before = {parts[place - 1] for _, parts in group} if place else set()
    if value.isdigit() and len(before) == 1 and (word := next(iter(before))).isalpha():
        return word + value
    return value


def _side(name: str) -> int:
    """Sort key: left before all other names, right after them."""
    return {"l": 0, "left": 0, "r": 2, "right": 2}.get(name.lower(), 1)


def natural_key(text: str) -> list[tuple[int, int, str]]:
    """Sort key in which 2 comes before 10."""
    return [
        (0, int(part), "") if part.isdigit() else (1, 0, part)
        for part in re.findall(r"\d+|\D+", text)
    ]
