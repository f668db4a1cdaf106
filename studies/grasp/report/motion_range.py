"""Active range of motion per joint, as hand therapists write it. Pure.

Of each closing, with a quarter of its duration before and after it (where the finger rests open
and closed), the smallest angle is the extension and the largest the flexion; a median over three
frames keeps a single slip of the measurement out. Means and standard deviations are over closings.

- Neutral-zero notation: extension-0-flexion. A joint that extends 10 deg beyond straight and flexes
  to 90 is 10-0-90; one that lacks 15 deg to straight is 0-15-90.
- TAM, total active motion (American Society for Surgery of the Hand): the three largest flexions
  minus what is missing to straight; extension beyond straight does not count.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.cycles.spread import spread
from studies.grasp.recording import ANGLES
from studies.grasp.report.study import Entry, Person, angles_of
from studies.grasp.track import finger_track

# Of a closing's duration, before and after it.
_MARGIN = 0.25


class JointRange(NamedTuple):
    """One joint of one person, deg; SD is NaN for a single closing."""

    joint: str
    extension: tuple[float, float]  # mean and SD of the smallest angle
    flexion: tuple[float, float]
    arc: tuple[float, float]
    closings: int

    @property
    def neutral_zero(self) -> str:
        """Such as 10-0-90 or 0-15-90."""
        low, high = round(self.extension[0]), round(self.flexion[0])
        if high < 0:
            return f"{-low}-{-high}-0"
        return f"{-low}-0-{high}" if low <= 0 else f"0-{low}-{high}"


class PersonRange(NamedTuple):
    """All joints of one person."""

    joints: list[JointRange]
    total_active: tuple[float, float]
    source: str  # measured, or the method whose angles stand in


def person_range(person: Person) -> PersonRange | None:
    """None where no frame has angles."""
    found = [one for entry in person.entries for one in _extremes(entry)]
    known = [(low, high) for low, high, _ in found if np.isfinite([*low, *high]).all()]
    if not known:
        return None
    lows, highs = (np.rad2deg(np.array([one[k] for one in known])) for k in (0, 1))
    joints = [
        JointRange(
            joint=name,
            extension=_mean_sd(lows[:, k]),
            flexion=_mean_sd(highs[:, k]),
            arc=_mean_sd(highs[:, k] - lows[:, k]),
            closings=len(known),
        )
        for k, name in enumerate(ANGLES)
    ]
    total = highs.sum(axis=1) - np.maximum(lows, 0.0).sum(axis=1)
    return PersonRange(joints, _mean_sd(total), found[0][2])


def _extremes(entry: Entry) -> Iterable[tuple[Array, Array, str]]:
    """Smallest and largest angles (3,) of each sequence, and where they come from."""
    track = finger_track(entry.recording) if entry.recording is not None else None
    for sequence in entry.recovery.sequences:
        angles, source = angles_of(sequence)
        if source == "measured" and track is not None:
            start, end = sequence.times_s[0], sequence.times_s[-1]
            margin = _MARGIN * (end - start) if sequence.kind != "whole" else 0.0
            inside = (track.times_s >= start - margin) & (track.times_s <= end + margin)
            angles = track.angles_rad[inside]
        angles = _median_of_three(angles[np.isfinite(angles).all(axis=1)])
        if len(angles):
            yield angles.min(axis=0), angles.max(axis=0), source


def _median_of_three(angles: Array) -> Array:
    if len(angles) < 3:
        return angles
    return np.median(np.stack([angles[:-2], angles[1:-1], angles[2:]]), axis=0)


def _mean_sd(values: Array) -> tuple[float, float]:
    found = spread(list(values[:, None]))
    return float(found.mean[0]), float(found.sd[0])
