"""Five synthetic people, and what was recovered of them; both made once for all tests."""

from __future__ import annotations

import time

import pytest

from services.cli.progress import Progress
from studies.grasp.recording import GraspRecording
from studies.grasp.recover.result import Recovery
from studies.grasp.recover.study import Settings, recover
from testing.synthetic_fingers import PEOPLE, Motion, recorded_person

# Dots that are seen to a tenth of a millimetre (a quarter of a pixel at 2.5 px/mm).
MOTION = Motion(cycles=3, fps=30.0, noise_mm=0.05)


def recovered(recordings: list[GraspRecording], settings: Settings) -> list[Recovery]:
    """All of them; raises the first error."""
    found = []
    for one in recover(recordings, settings, time.perf_counter, Progress("", 0, False)):
        if isinstance(one, Exception):
            raise one
        found.append(one)
    return found


@pytest.fixture(scope="session")
def people() -> list[GraspRecording]:
    """Noise of 0.05 mm."""
    return [recorded_person(person, MOTION) for person in PEOPLE]


@pytest.fixture(scope="session")
def recoveries(people: list[GraspRecording]) -> list[Recovery]:
    """By all methods."""
    return recovered(people, Settings())
