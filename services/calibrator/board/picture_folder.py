"""Picture folders: which file is which camera's view of which board position, found out from the
names.

Understood are a folder per camera (`left/03.png`, `right/03.png`) and names in which one part is
the camera and the rest the position (`left03.jpg`, `right_03.png`, `03-cam0.png`, `imgL3.png`).
Files that do not fit, or that have no partner, are listed, not used. A folder whose names say
nothing is a CalibrationError with examples of names that work.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from rhot.errors import CalibrationError

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp")
_TOKEN = re.compile(r"[A-Za-z]+|\d+")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")
_EXAMPLES = "name them <camera><number>, e.g. left01.png and right01.png, or use one folder per camera (both views in one picture: --side-by-side)"
# More cameras than this are never one rig here: the varying part is then the number of the picture.
_MAX_CAMERAS = 16
# Two pictures of 4:3 side by side are 2.67 times as wide as high, one of 16:9 is 1.78.
_WIDE = 2.2
Key = tuple[str, ...]


@dataclass(frozen=True)
class PictureSet:
    """files[camera][key] is a picture; one key is one position of the board. left_out are files
    that were not understood.

    side_by_side: a file holds the pictures of all cameras, the first one on the left.
    """

    files: dict[str, dict[str, Path]]
    left_out: tuple[Path, ...] = ()
    side_by_side: bool = False

    @property
    def cameras(self) -> list[str]:
        """Camera names, in the order of the alphabet, but left before right."""
        return list(self.files)

    def positions(self) -> list[str]:
        """Every board position some camera has a picture of, in order."""
        return sorted({key for pictures in self.files.values() for key in pictures}, key=natural)

    def read(self, camera: str, key: str) -> np.ndarray:
        """One camera's picture as grey (h, w) uint8.

        Raises CalibrationError if it cannot be read.
        """
        image = read_grey(self.files[camera][key])
        return (
            split_side_by_side(image, len(self.files))[self.cameras.index(camera)]
            if self.side_by_side
            else image
        )


def read_grey(path: Path) -> np.ndarray:
    """A picture as grey (h, w) uint8, as the sensor delivered it (EXIF rotation is not applied).

    Raises CalibrationError if the file is no picture.
    """
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise CalibrationError(f"{path}: is not a picture that can be read; use PNG or JPEG")
    return image


def one_camera(folder: Path, camera: str) -> PictureSet:
    """All pictures of one camera in a folder: those of its name if there are any, else all of them.

    Raises CalibrationError if there is none.
    """
    files = _pictures(folder)
    own = [
        path for path in files if camera in (path.parent.name, *_parts(path.relative_to(folder)))
    ] or files
    return PictureSet({camera: {str(path.relative_to(folder)): path for path in own}})


def picture_of(folder: Path, camera: str) -> Path | None:
    """The first picture in a folder that is named after the camera (`left.png`, `desk_left.jpg`);
    None without one.

    Raises CalibrationError if the folder has no pictures at all.
    """
    return next(
        (
            path
            for path in _pictures(folder)
            if path.stem == camera or camera in _parts(path.relative_to(folder))
        ),
        None,
    )


def side_by_side(folder: Path, cameras: list[str]) -> PictureSet:
    """All pictures of a folder, each holding the views of these cameras, from left to right.

    Raises CalibrationError if there is none, or only one camera is named.
    """
    if len(cameras) < 2:
        raise CalibrationError(
            f"pictures side by side need the names of two cameras or more, e.g. --cameras left,right; got {cameras}"
        )
    files = {str(path.relative_to(folder).with_suffix("")): path for path in _pictures(folder)}
    return PictureSet(dict.fromkeys(cameras, files), side_by_side=True)


def find_pictures(folder: Path, cameras: list[str] | None = None) -> PictureSet:
    """The pictures of a rig's cameras in a folder; cameras says which names to expect, if they are
    known.

    Names that tell one series only, of pictures as wide as two, are taken for both views side by
    side.

    Raises CalibrationError if the names do not tell cameras and positions apart.
    """
    files = _pictures(folder)
    groups: dict[tuple[str, ...], list[tuple[Path, list[str]]]] = defaultdict(list)
    for path in files:
        parts = _parts(path.relative_to(folder))
        groups[_shape(parts)].append((path, parts))
    best: _Reading | None = None
    for group in groups.values():
        found = _split(group, cameras)
        if found and (best is None or _worth(found) > _worth(best)):
            best = found
    if best is None and _is_wide(files[0]):
        return side_by_side(folder, cameras or ["left", "right"])
    if best is None:
        expected = f" of {' and '.join(cameras)}" if cameras else ""
        some = ", ".join(str(path.relative_to(folder)) for path in files[:4])
        raise CalibrationError(
            f"{folder}: cannot tell pictures{expected} apart by their names ({some}, ...); {_EXAMPLES}"
        )
    used = {path for pictures in best.files.values() for path in pictures.values()}
    return PictureSet(_in_step(best.files), tuple(path for path in files if path not in used))


def _is_wide(path: Path) -> bool:
    """Whether a picture is as wide as two; no if it cannot be read."""
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    return image is not None and image.shape[1] >= _WIDE * image.shape[0]


def split_side_by_side(image: np.ndarray, count: int) -> list[np.ndarray]:
    """The pictures of `count` cameras that stand side by side in one; (h, w) -> count times (h, w /
    count).

    Raises CalibrationError if the width cannot be shared.
    """
    width = image.shape[1]
    if width % count:
        raise CalibrationError(
            f"a picture {width} px wide cannot be {count} equal ones side by side"
        )
    return [np.ascontiguousarray(part) for part in np.split(image, count, axis=1)]


def _in_step(files: dict[str, dict[str, Path]]) -> dict[str, dict[str, Path]]:
    """Pictures named by the time they were taken share no name: as many from each camera are paired
    in their order.

    Wrongly paired ones are found out by the calibration, which refuses them.
    """
    counts = {len(pictures) for pictures in files.values()}
    if len(counts) > 1 or set.intersection(*(set(pictures) for pictures in files.values())):
        return files
    return {
        camera: {
            str(number): pictures[key]
            for number, key in enumerate(sorted(pictures, key=natural), start=1)
        }
        for camera, pictures in files.items()
    }


def _pictures(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise CalibrationError(f"{folder}: no such folder; give the folder of the board's pictures")
    files = [
        path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES and path.is_file()
    ]
    # Hidden folders hold thumbnails and the like.
    files = [
        path
        for path in files
        if not any(part.startswith(".") for part in path.relative_to(folder).parts)
    ]
    if not files:
        raise CalibrationError(f"{folder}: holds no pictures ({', '.join(SUFFIXES)}); {_EXAMPLES}")
    return sorted(files, key=lambda path: natural(str(path)))


def _parts(path: Path) -> list[str]:
    """Folder names as they are, then the letters and numbers of the file's name."""
    return [*path.parts[:-1], *_TOKEN.findall(path.stem)]


def _shape(parts: list[str]) -> Key:
    return (str(len(parts)), *("9" if part.isdigit() else "a" for part in parts))


def _split(group: list[tuple[Path, list[str]]], cameras: list[str] | None) -> _Reading | None:
    """One part of the names as the camera: the one with which the most positions are seen by all
    cameras.
    """
    best: _Reading | None = None
    for place in range(len(group[0][1])):
        values = Counter(parts[place] for _, parts in group)
        if cameras and not set(cameras) <= set(values):
            continue
        if not cameras and not 2 <= len(values) <= _MAX_CAMERAS:
            continue
        found = _by_place(group, place, cameras)
        # On a draw the earlier part wins, and letters win over numbers: 1_left, 1_right.
        if found and (best is None or _worth(found) > _worth(best)):
            best = found
    return best


def _by_place(
    group: list[tuple[Path, list[str]]], place: int, cameras: list[str] | None
) -> _Reading | None:
    files: dict[str, dict[str, Path]] = defaultdict(dict)
    for path, parts in group:
        # A camera's name may be repeated, as in left/left01.png, and its partner's number may have
        # other leading zeros.
        rest = [
            part
            for part in parts[:place] + parts[place + 1 :]
            if part != parts[place] or part.isdigit()
        ]
        key = "-".join(str(int(part)) if part.isdigit() else part for part in rest) or "0"
        if key in files[parts[place]]:
            return None
        files[parts[place]][key] = path
    named = {
        _camera_name(group, place, value): pictures
        for value, pictures in files.items()
        if cameras is None or value in cameras
    }
    if len(named) < 2 or not all(_NAME.match(name) for name in named):
        return None
    # One picture of each is a series of one camera, or pictures side by side, whose numbers are
    # positions.
    if len(group) > 2 and all(len(pictures) == 1 for pictures in named.values()):
        return None
    order = cameras or sorted(named, key=lambda name: (_side(name), natural(name)))
    return _Reading({name: named[name] for name in order}, all(value.isdigit() for value in files))


def _camera_name(group: list[tuple[Path, list[str]]], place: int, value: str) -> str:
    """The camera's name: a bare number takes the letters before it along (`cam` + `0`)."""
    before = {parts[place - 1] for _, parts in group} if place else set()
    if value.isdigit() and len(before) == 1 and (word := next(iter(before))).isalpha():
        return word + value
    return value


@dataclass(frozen=True)
class _Reading:
    """One way to read the names: the cameras' pictures, and whether only a number tells the cameras
    apart.
    """

    files: dict[str, dict[str, Path]]
    numbered: bool


def _worth(found: _Reading) -> tuple[int, int, int]:
    """How much speaks for a reading of the names: positions all cameras share, named rather than
    numbered, few cameras.
    """
    shared = set.intersection(*(set(pictures) for pictures in found.files.values()))
    return len(shared) * len(found.files), 0 if found.numbered else 1, -len(found.files)


def _side(name: str) -> int:
    return {"l": 0, "left": 0, "r": 2, "right": 2}.get(name.lower(), 1)


def natural(text: str) -> list[tuple[int, int, str]]:
    """Sort key in which 2 comes before 10."""
    return [
        (0, int(part), "") if part.isdigit() else (1, 0, part)
        for part in re.findall(r"\d+|\D+", text)
    ]
