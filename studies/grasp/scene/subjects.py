"""Five people: bones, flesh, skin, and how the DIP joint follows the PIP joint.

Bones scatter about Buryanov & Kotiuk 2010 (index 39.8/22.4/15.8 + 3.8 mm of pulp; thumb
46.2/31.6/21.7 + 5.7). The laws are as different as in the paper's Fig. 7: four linear, the fourth
subject's quadratic; only the first is the 2/3 that closed forms assume.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.errors import ConfigError
from rhot.geometry.transforms import Array


class DipLaw(NamedTuple):
    """DIP = constant + linear * PIP + quadratic * PIP^2, in radians."""

    constant: float
    linear: float
    quadratic: float = 0.0

    def dip(self, pip_rad: Array) -> Array:
        """The DIP angles (n,) of PIP angles (n,)."""
        return self.constant + pip_rad * (self.linear + pip_rad * self.quadratic)


class Subject(NamedTuple):
    """One person; lengths in mm, angles in degrees.

    lengths: proximal, middle, distal phalanx of the index finger; thumb: metacarpal, proximal,
    distal. radii: half the finger's thickness at MCP, PIP, DIP and tip. closed_deg: MCP and PIP of
    the fist. skin: blue, green, red under full light, 0..1. crease: how deep wrinkles look.
    """

    name: str
    lengths: tuple[float, float, float]
    thumb: tuple[float, float, float]
    radii: tuple[float, float, float, float]
    law: DipLaw
    closed_deg: tuple[float, float]
    skin: tuple[float, float, float]
    crease: float


SUBJECTS = (
    Subject(
        "subject-1",
        (39.8, 22.4, 18.6),
        (46.2, 31.6, 24.6),
        (11.2, 8.6, 7.2, 5.6),
        DipLaw(0.0, 2.0 / 3.0),
        (84.0, 104.0),
        (0.58, 0.68, 0.90),
        1.0,
    ),
    Subject(
        "subject-2",
        (36.3, 20.6, 16.9),
        (42.0, 28.7, 22.8),
        (10.2, 7.7, 6.5, 5.1),
        DipLaw(0.03, 0.50),
        (80.0, 108.0),
        (0.66, 0.75, 0.93),
        0.7,
    ),
    Subject(
        "subject-3",
        (44.2, 25.7, 20.4),
        (50.1, 34.2, 26.9),
        (12.4, 9.6, 8.1, 6.3),
        DipLaw(-0.05, 0.84),
        (87.0, 99.0),
        (0.33, 0.43, 0.62),
        1.3,
    ),
    Subject(
        "subject-4",
        (41.1, 24.0, 17.7),
        (47.8, 30.0, 25.2),
        (11.0, 8.9, 7.3, 5.4),
        DipLaw(0.02, 0.10, 0.36),
        (82.0, 102.0),
        (0.50, 0.60, 0.82),
        1.1,
    ),
    Subject(
        "subject-5",
        (38.0, 21.2, 19.9),
        (44.5, 32.3, 23.6),
        (11.8, 9.0, 7.7, 6.0),
        DipLaw(0.09, 0.40),
        (76.0, 96.0),
        (0.22, 0.29, 0.44),
        0.9,
    ),
)


def subject_named(name: str) -> Subject:
    """One of SUBJECTS; ConfigError names them all."""
    for subject in SUBJECTS:
        if name in (subject.name, subject.name.removeprefix("subject-")):
            return subject
    valid = ", ".join(subject.name for subject in SUBJECTS)
    raise ConfigError(f"no subject {name!r}; valid: {valid}")


def chain(lengths: tuple[float, ...], angles_rad: Array, start: tuple[float, float]) -> Array:
    """Joints (k + 1, 2) of a chain of k bones in the finger's plane: x along the base line, y
    towards the palm; each angle flexes its bone against the bone before.
    """
    turned = np.cumsum(angles_rad)  # (k,)
    steps = np.asarray(lengths)[:, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]) + np.asarray(start)
