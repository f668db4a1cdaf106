"""Index fingers that close and open, as recordings of a grasp study: angles known, noise as asked.

Five people with bones and DIP-PIP laws of their own (three straight lines that are not 2/3 PIP, one
that is, one bent); each closing starts at the distal joints and ends at the knuckle, as the
finger study shows it (MCP low during the first third), with other timing in each cycle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.planar import joints_of
from studies.grasp.recording import ANGLES, JOINTS, GraspFrame, GraspRecording


@dataclass(frozen=True)
class Person:
    """Bones in mm; DIP = law[0] + law[1] PIP + law[2] PIP^2 (rad); closed MCP and PIP in deg."""

    name: str
    lengths_mm: tuple[float, float, float]
    law: tuple[float, float, float]
    closed_deg: tuple[float, float]


PEOPLE = (
    Person("s1", (45.1, 25.6, 18.9), (0.00, 0.80, 0.00), (82.0, 102.0)),
    Person("s2", (39.8, 22.4, 19.6), (0.05, 0.50, 0.00), (75.0, 98.0)),
    Person("s3", (42.3, 27.0, 20.8), (0.00, 2.0 / 3.0, 0.00), (86.0, 106.0)),
    Person("s4", (36.9, 21.2, 17.2), (0.04, 0.15, 0.36), (78.0, 94.0)),
    Person("s5", (47.7, 28.3, 21.9), (-0.06, 0.74, 0.00), (88.0, 100.0)),
)


@dataclass(frozen=True)
class Motion:
    """How often, how fast and how cleanly a finger closes."""

    cycles: int = 5
    fps: float = 37.0 / 2.0
    close_s: float = 2.0
    rest_s: float = 0.5
    noise_mm: float = 0.0
    stretch: float = 0.0  # how much longer the phalanges are in a closed fist, as a share
    seed: int = 1


def smooth_step(u: Array) -> Array:
    """0 before 0, 1 after 1, without a jump of acceleration."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def closing_share(u: Array) -> tuple[Array, Array]:
    """Shares of full flexion of MCP and PIP at a share u of a closing."""
    return smooth_step((u - 0.25) / 0.75), smooth_step(u / 0.8)


def person_angles(person: Person, motion: Motion) -> tuple[Array, Array]:
    """Times (n,) and angles (n, 3) of all cycles: rest, closing, rest, opening, ... rest."""
    rng = np.random.default_rng([motion.seed, ord(person.name[-1])])
    marks, shares, now = [0.0], [0.0], 0.0
    sizes = [0.0]
    for _ in range(motion.cycles):
        close_s = motion.close_s * rng.uniform(0.85, 1.15)
        size = rng.uniform(0.97, 1.0)
        for step_s, share in ((motion.rest_s, 0), (close_s, 1), (motion.rest_s, 1), (close_s, 0)):
            now += max(step_s, 1e-6)
            marks.append(now)
            shares.append(float(share))
            sizes.append(size)
    marks.append(now + max(motion.rest_s, 1e-6))
    shares.append(0.0)
    sizes.append(sizes[-1])
    times = np.arange(0.0, marks[-1], 1.0 / motion.fps)
    u = np.interp(times, marks, shares)
    size = np.array(sizes)[np.clip(np.searchsorted(marks, times), 0, len(sizes) - 1)]
    mcp, pip = (size * share for share in closing_share(u))
    open_deg = np.array([-4.0, 6.0])
    bent = [
        np.deg2rad(low + (high - low) * share)
        for low, high, share in zip(open_deg, person.closed_deg, (mcp, pip), strict=True)
    ]
    a, b, c = person.law
    return times, np.column_stack([*bent, a + b * bent[1] + c * bent[1] ** 2])


def recorded_person(person: Person, motion: Motion) -> GraspRecording:
    """What a perfect measurement with that noise would give."""
    times, angles = person_angles(person, motion)
    rng = np.random.default_rng([motion.seed, 7, ord(person.name[-1])])
    bend = angles.sum(axis=1) / angles.sum(axis=1).max()
    lengths = np.array(person.lengths_mm) * (1.0 + motion.stretch * bend[:, None])
    joints = joints_of(angles, lengths)
    joints = joints + rng.normal(0.0, 1.0, joints.shape) * motion.noise_mm
    if motion.noise_mm:
        bones = np.diff(joints, axis=1)
        turns = np.unwrap(np.arctan2(bones[..., 1], bones[..., 0]), axis=1)
        angles = np.diff(turns, axis=1, prepend=0.0)
        angles[:, 1:] = (angles[:, 1:] + np.pi) % (2.0 * np.pi) - np.pi
        joints = joints - joints[:, :1]
    frames = [
        GraspFrame(
            frame=k,
            time_s=float(times[k]),
            points={name: tuple(joints[k, j].tolist()) for j, name in enumerate(JOINTS)},
            points_sigma=dict.fromkeys(JOINTS, motion.noise_mm),
            angles_rad=dict(zip(ANGLES, angles[k].tolist(), strict=True)),
            tip_direction_rad=float(angles[k].sum()),
        )
        for k in range(len(times))
    ]
    return GraspRecording(
        subject=person.name,
        source="testing/synthetic_fingers.py",
        method="truth",
        unit="mm",
        lengths=person.lengths_mm,
        frames=frames,
    )
