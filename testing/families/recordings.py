"""Recorded hands of RHOT_DATA as motions of six landmarks.

Leap: the wrist's marker lies 60 mm behind the palm's centre, against the palm's direction; the
cameras look at the palm as the sensor did. Qualisys: the glove's marker on the back of the hand
stands for the wrist's.
"""

from __future__ import annotations

import csv
import gzip
import os
from pathlib import Path

import numpy as np

from rhot.geometry.transforms import Array
from testing.families.motions import SampledMotion, placed

_DATA = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[3] / "shared" / "data"))
_LEAP_FINGERS = ("thumb", "index", "middle", "ring", "pinky")
_GLOVE = ("hand_top", "thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip")
# From the palm's centre to the wrist's marker.
_WRIST_M = 0.06


def _path(name: str) -> Path:
    """A recording; raises SystemExit that says where recordings are looked for."""
    path = _DATA / "hand_motion" / name
    if not path.is_file():
        raise SystemExit(f"no recording {path}; set RHOT_DATA to the folder of real recordings")
    return path


def leap_motion(name: str, distance_m: float = 0.5, stretch: float = 1.0) -> SampledMotion:
    """A Leap recording; stretch 2 is half its speed."""
    with _path(f"leap/{name}.csv").open() as file:
        rows = list(csv.DictReader(file))

    def vectors(of: str, scale: float) -> Array:
        return scale * np.array([[float(row[f"{of}_{axis}"]) for axis in "xyz"] for row in rows])

    times_s = 1e-6 * stretch * np.array([float(row["timestamp_us"]) for row in rows])
    wrist = vectors("palm", 1e-3) - _WRIST_M * vectors("direction", 1.0)
    points = np.stack([wrist, *(vectors(f"{f}_tip", 1e-3) for f in _LEAP_FINGERS)], axis=1)
    # The sensor lies on the table, its y up and its z towards the user; cameras look along y.
    points = np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=2)
    fresh = np.concatenate([[True], np.diff(times_s) > 1e-4])
    return SampledMotion(times_s[fresh], placed(points[fresh], distance_m))


def glove_motion(first: int, last: int, distance_m: float = 0.5) -> SampledMotion:
    """Frames first..last (100 a second) of the Qualisys recording; gaps are bridged."""
    with gzip.open(_path("qualisys/recording.tsv.gz"), "rt") as file:
        table = [line.rstrip("\n").split("\t") for line in file]
    begin = next(k for k, row in enumerate(table) if row[0] == "Frame")
    columns = [table[begin].index(f"{name} X") for name in _GLOVE]
    rows = [row for row in table[begin + 1 :] if len(row) > max(columns) + 2][first:last]
    points = 1e-3 * np.array(
        [[[float(row[c + k] or "nan") for k in range(3)] for c in columns] for row in rows]
    )
    times_s = np.array([float(row[1]) for row in rows])
    whole = (np.isfinite(points) & (points != 0.0)).all(axis=(1, 2))
    points = points * np.array([1.0, -1.0, -1.0])
    return SampledMotion(times_s[whole], placed(points[whole], distance_m))
