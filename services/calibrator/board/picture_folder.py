"""A folder of pictures: which file is which camera's picture of which board position.

Understood are a folder per camera (`left/03.png`, `right/03.png`) and names in which one part is
the camera and the rest the position (`left03.jpg`, `right_03.png`, `03-cam0.png`, `imgL3.png`).
Files that do not fit, or that have no partner, are listed, not used. A folder whose names tell
nothing is a CalibrationError with examples of names that do.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from rhot.errors import CalibrationError
from services.calibrator.board.picture_names import Files, name_parts, natural_key, read_names

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp")
_EXAMPLES = (
    "name them <camera><number>, e.g. left01.png and right01.png, or use one folder per camera "
    "(both views in one picture: --side-by-side)"
)
# Two pictures of 4:3 side by side are 2.67 times as wide as high, one of 16:9 is 1.78.
_WIDE = 2.2
# Names of the cameras of pictures side by side, unless they are given.
_SIDES = ("left", "right")


@dataclass(frozen=True)
class PictureSet:
    """files[camera][key] is a picture; one key is one position of the board.

    left_out are files that were not understood. side_by_side: a file holds the pictures of all
    cameras, the first one on the left.
    """

    files: Files
    left_out: tuple[Path, ...] = ()
    side_by_side: bool = False

    @property
    def cameras(self) -> list[str]:
        """Camera names, in the order of the alphabet, but left before right."""
        return list(self.files)

    def positions(self) -> list[str]:
        """The keys of all board positions that some camera has a picture of, in order."""
        keys = {key for pictures in self.files.values() for key in pictures}
        return sorted(keys, key=natural_key)

    def read(self, camera: str, key: str) -> np.ndarray:
        """One camera's picture as grey (h, w) uint8.

        Raises CalibrationError if it cannot be read.
        """
        image = read_grey(self.files[camera][key])
        if not self.side_by_side:
            return image
        return split_side_by_side(image, len(self.files))[self.cameras.index(camera)]


def find_pictures(folder: Path, cameras: list[str] | None = None) -> PictureSet:
    """The pictures of a rig's cameras in a folder; `cameras` are the names to expect, if known.

    Names of one series only, of pictures as wide as two, are taken for both views side by side.
    Raises CalibrationError if the names do not tell cameras and positions apart.
    """
    paths = _pictures(folder)
    reading = read_names(paths, folder, cameras)
    if reading is None and _is_wide(paths[0]):
        return side_by_side(folder, cameras or list(_SIDES))
    if reading is None:
        expected = f" of {' and '.join(cameras)}" if cameras else ""
        some = ", ".join(str(path.relative_to(folder)) for path in paths[:4])
        raise CalibrationError(
            f"{folder}: cannot tell pictures{expected} apart by their names ({some}, ...); "
            f"{_EXAMPLES}"
        )
    used = {path for pictures in reading.files.values() for path in pictures.values()}
    left_out = tuple(path for path in paths if path not in used)
    return PictureSet(_paired_in_order(reading.files), left_out)


def one_camera(folder: Path, camera: str) -> PictureSet:
    """All pictures of one camera in a folder: those of its name if there are any, else all of them.

    Raises CalibrationError if there is none.
    """
    paths = _pictures(folder)
    own = [
        path
        for path in paths
        if camera in (path.parent.name, *name_parts(path.relative_to(folder)))
    ]
    return PictureSet({camera: {str(path.relative_to(folder)): path for path in own or paths}})


def mixed_cameras(folder: Path, camera: str) -> str:
    """A sentence if a folder's names are those of several cameras, none of them this one; or empty.

    Raises CalibrationError if there are no pictures.
    """
    paths = _pictures(folder)
    reading = read_names(paths, folder)
    if reading is None or any(camera in name_parts(path.relative_to(folder)) for path in paths):
        return ""
    # Numbers alone are a date, or those of a series, unless they are a camera's.
    if reading.numbered and not all(name.lower().startswith("cam") for name in reading.files):
        return ""
    counts = [f"{len(pictures)} of {name!r}" for name, pictures in reading.files.items()]
    return (
        f"{folder}: by their names these are pictures of {len(counts)} cameras "
        f"({', '.join(counts)}), and none is named after {camera!r}; a lens is calibrated from "
        f"the pictures of one camera: give its name ({', '.join(reading.files)}), or a folder of "
        "its own"
    )


def picture_of(folder: Path, camera: str) -> Path | None:
    """The first picture that is named after the camera (`left.png`, `desk_left.jpg`), or None.

    Raises CalibrationError if the folder has no pictures at all.
    """
    for path in _pictures(folder):
        if path.stem == camera or camera in name_parts(path.relative_to(folder)):
            return path
    return None


def side_by_side(folder: Path, cameras: list[str]) -> PictureSet:
    """All pictures of a folder, each holding the views of these cameras, from left to right.

    Raises CalibrationError if there is none, or only one camera is named.
    """
    if len(cameras) < 2:
        raise CalibrationError(
            "pictures side by side need the names of two cameras or more, "
            f"e.g. --cameras left,right; got {cameras}"
        )
    files = {str(path.relative_to(folder).with_suffix("")): path for path in _pictures(folder)}
    return PictureSet(dict.fromkeys(cameras, files), side_by_side=True)


def read_grey(path: Path) -> np.ndarray:
    """A picture as grey (h, w) uint8, as the sensor delivered it (EXIF rotation is not applied).

    Raises CalibrationError if the file is no picture.
    """
    image = _grey_or_none(path)
    if image is None:
        raise CalibrationError(
            f"{path}: is not a picture that can be read; use PNG or JPEG, or take it out of the "
            "folder"
        )
    return image


def split_side_by_side(image: np.ndarray, count: int) -> list[np.ndarray]:
    """The `count` pictures (h, w / count) that stand side by side in one (h, w).

    Raises CalibrationError if the width cannot be shared.
    """
    width = image.shape[1]
    if width % count:
        raise CalibrationError(
            f"a picture {width} px wide cannot be {count} equal ones side by side; name as many "
            "cameras as each picture has views, e.g. --cameras left,right"
        )
    return [np.ascontiguousarray(part) for part in np.split(image, count, axis=1)]


def _is_wide(path: Path) -> bool:
    """Whether a picture is as wide as two; no if it cannot be read."""
    image = _grey_or_none(path)
    return image is not None and image.shape[1] >= _WIDE * image.shape[0]


def _grey_or_none(path: Path) -> np.ndarray | None:
    return cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)


def _paired_in_order(files: Files) -> Files:
    """As many pictures from each camera that share no key are paired in their order.

    Pictures named by the time they were taken are such. Wrongly paired ones are found out by the
    calibration, which refuses them.
    """
    counts = {len(pictures) for pictures in files.values()}
    if len(counts) > 1 or set.intersection(*(set(pictures) for pictures in files.values())):
        return files
    return {
        camera: {
            str(number): pictures[key]
            for number, key in enumerate(sorted(pictures, key=natural_key), start=1)
        }
        for camera, pictures in files.items()
    }


def _pictures(folder: Path) -> list[Path]:
    """All picture files in and below a folder, in natural order.

    Hidden folders are passed over: they hold thumbnails and the like.
    """
    if not folder.is_dir():
        raise CalibrationError(f"{folder}: no such folder; give the folder of the board's pictures")
    paths = [
        path
        for path in folder.rglob("*")
        if path.suffix.lower() in SUFFIXES
        and path.is_file()
        and not any(part.startswith(".") for part in path.relative_to(folder).parts)
    ]
    if not paths:
        raise CalibrationError(f"{folder}: holds no pictures ({', '.join(SUFFIXES)}); {_EXAMPLES}")
    return sorted(paths, key=lambda path: natural_key(str(path)))
