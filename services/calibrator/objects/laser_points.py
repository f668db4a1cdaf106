"""Points of a laser tracker and a Vive tracker's poses at them: folders of the kind of
MarvinGravert/Vive-Accuracy-Experiment.

A folder holds one table of the laser's points (comma-separated, millimetres, the first three
columns) and one text of poses for each place: rows of `x y z w i j k` (metres, wxyz) or of OpenVR's
3x4 matrix; other lines are passed over. At each place the laser measures three reflectors at a
right angle, mostly origin, x, y, and the origin once more. Rows that are not of that form (how the
laser's own frame was set, its home position) are told apart by that. Places are in the order of the
numbers in the names of their files.
"""

from __future__ import annotations

import csv
import gzip
import re
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    transform,
)
from services.calibrator.objects.points import PointRegistration, register_points
from services.calibrator.objects.sightings import Bools

# The origin measured again lies within this, mm; reflectors are so far apart, at a right angle to
# within this cosine (1 deg; plates are made to .1).
_AGAIN_MM, _APART_MM, _SQUARE = 2.0, 20.0, 0.02
# Quaternions and matrices are given with six digits or more.
_UNIT_TOLERANCE = 1e-2
# More places than this are left out of neither list to make them match.
_MAX_LEFT_OUT = 3


@dataclass(frozen=True, eq=False)
class LaserExperiment:
    """The origins of the reflectors' frames (n, 3) m, which were measured again (n,), and the
    tracker's poses (m, 4, 4).
    """

    points_m: Array
    again: Bools
    poses: Array


def read_experiment(folder: Path) -> LaserExperiment:
    """All places of a folder.

    Raises CalibrationError if it holds no laser's table, or no poses.
    """
    tables = [_origins(path) for path in sorted(folder.iterdir()) if path.is_file()]
    points, again = max(tables, key=lambda found: len(found[0]), default=(np.zeros((0, 3)), None))
    if again is None or not len(points):
        raise CalibrationError(
            f"{folder}: no table of a laser tracker, comma-separated in mm, with groups of three "
            "points at a right angle"
        )
    places = []
    for path in folder.iterdir():
        # What has no number (registrationPoint.txt) is no place of its own.
        number = re.search(r"(\d+)\.txt$", _stem(path))
        if number and (pose := _middle_pose(path)) is not None:
            places.append((int(number[1]), pose))
    if not places:
        raise CalibrationError(
            f"{folder}: no files named ...1.txt, ...2.txt with rows `x y z w i j k` or 3x4 matrices"
        )
    places.sort(key=lambda place: place[0])
    return LaserExperiment(points, again, np.stack([pose for _, pose in places]))


def register_laser(experiment: LaserExperiment) -> PointRegistration:
    """The fit of the tracker's poses to the laser's points.

    Of the points those that were measured again, or all: whichever is nearer to one for one. Where
    one list is longer by up to three, those are left out that fit least. Raises CalibrationError
    where the lists differ by more.
    """
    points, poses = experiment.points_m, experiment.poses
    lists = sorted((points[experiment.again], points), key=lambda some: abs(len(some) - len(poses)))
    surplus = len(lists[0]) - len(poses)
    if abs(surplus) > _MAX_LEFT_OUT or not len(lists[0]):
        raise CalibrationError(
            f"the laser has {len(lists[0])} places, the tracker {len(poses)}: one for one is needed"
        )
    fits = []
    for left_out in combinations(range(max(len(lists[0]), len(poses))), abs(surplus)):
        mine = np.delete(lists[0], left_out, axis=0) if surplus > 0 else lists[0]
        theirs = np.delete(poses, left_out, axis=0) if surplus < 0 else poses
        fits.append(register_points(mine, theirs))
    return min(fits, key=lambda found: found.rms_m)


def _stem(path: Path) -> str:
    """The name, lower case and without .gz."""
    return path.name.lower().removesuffix(".gz")


def _lines(path: Path) -> list[str]:
    content = path.read_bytes()
    if path.suffix == ".gz":
        content = gzip.decompress(content)
    return content.decode(errors="replace").splitlines()


def _origins(path: Path) -> tuple[Array, Bools]:
    """Origins (n, 3) in metres of the reflectors' frames in a laser's table, and which of them were
    measured again; none if it is no such table.
    """
    rows = []
    for cells in csv.reader(_lines(path)):
        try:
            rows.append([float(cell) for cell in cells[:3]])
        except ValueError:
            continue
    table = np.array([row for row in rows if len(row) == 3]).reshape(-1, 3)
    used = np.zeros(len(table), dtype=bool)
    found: dict[int, tuple[Array, bool]] = {}
    # The surest first: groups whose origin was measured again.
    for count in (4, 3):
        for i in range(len(table) - count + 1):
            origin = _origin(table[i : i + count])
            if origin is not None and not used[i : i + count].any():
                used[i : i + count] = True
                found[i] = origin, count == 4
    origins = np.array([found[i][0] for i in sorted(found)]).reshape(-1, 3)
    return 1e-3 * origins, np.array([found[i][1] for i in sorted(found)], dtype=bool)


def _origin(group: Array) -> Array | None:
    """The origin (3,) of a group of three points, or of four of which the last is that origin.

    It is the one at which the other two are seen at a right angle. Of three alone they must also
    be equally far: any three places may form a right angle.
    """
    for k in range(3):
        first, second = np.delete(group[:3], k, axis=0) - group[k]
        lengths = float(np.linalg.norm(first)), float(np.linalg.norm(second))
        square = abs(first @ second) <= _SQUARE * lengths[0] * lengths[1]
        if min(lengths) < _APART_MM or not square:
            continue
        if len(group) == 3 and abs(lengths[0] - lengths[1]) <= _AGAIN_MM:
            return np.asarray(group[k])
        if len(group) == 4 and np.linalg.norm(group[3] - group[k]) <= _AGAIN_MM:
            return np.asarray(0.5 * (group[3] + group[k]))
    return None


def _middle_pose(path: Path) -> Array | None:
    """The middle pose (4, 4) of a place's file: medians, as single poses jump; None if it has
    none.
    """
    poses = [pose for line in _lines(path) if (pose := _pose(line)) is not None]
    if not poses:
        return None
    stacked = np.stack(poses)
    # The rotation nearest to the median of the matrices; reflections cannot arise from poses that
    # hardly differ.
    U, _, Vt = np.linalg.svd(np.median(stacked[:, :3, :3], axis=0))
    R = rotation_from_quaternion(quaternion_from_rotation(U @ Vt))
    return transform(R, np.median(stacked[:, :3, 3], axis=0))


def _pose(line: str) -> Array | None:
    """One row as a pose (4, 4); None if it is none."""
    try:
        values = np.array([float(word) for word in re.split(r"[\s,;]+", line.strip())])
    except ValueError:
        return None
    if len(values) not in (7, 12) or not np.all(np.isfinite(values)):
        return None
    if len(values) == 7:
        if abs(float(np.linalg.norm(values[3:])) - 1.0) > _UNIT_TOLERANCE:
            return None
        return transform(rotation_from_quaternion(values[3:]), values[:3])
    rows = values.reshape(3, 4)
    if np.abs(rows[:, :3] @ rows[:, :3].T - np.eye(3)).max() > _UNIT_TOLERANCE:
        return None
    return transform(rows[:, :3], rows[:, 3])
