"""Faults of a rig's cameras, clocks and network, each with the result it must have.

Every fault begins at 2 s of a moving hand. In all of them nothing hangs, no more than one point in
two hundred is further than five of its sigmas from the truth, and half a second after the fault
ends all landmarks are there again, within 3 mm RMS (4.5 after names were swapped).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import msgspec
import numpy as np
import pytest

from rhot.messages import MarkerFrame
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

BEGIN_S, RECOVERY_S, AFTER_S = 2.0, 0.5, 2.0
# Clocks as well known as a LAN allows, so that errors are the fault's.
SETUP, MOVING = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4), MovingHand()

Change = Callable[[MarkerFrame], MarkerFrame | None]
replace = msgspec.structs.replace


def lost(frame: MarkerFrame) -> None:
    """The frame never arrives."""


def later(seconds: float) -> Change:
    """The camera's clock reads that much more, and nobody has measured it anew yet."""
    return lambda frame: replace(frame, stamp_ns=frame.stamp_ns + round(seconds * 1e9))


def swapped(frame: MarkerFrame) -> MarkerFrame:
    names = {"blue": "cyan", "cyan": "blue"}
    return replace(
        frame, markers=[replace(m, color=names.get(m.color, m.color)) for m in frame.markers]
    )


def mirrored(frame: MarkerFrame) -> MarkerFrame:
    return replace(frame, markers=[replace(m, x_px=639.0 - m.x_px) for m in frame.markers])


class During(Enum):
    """What is reported while the fault lasts, once hold_s has passed."""

    NOTHING = "no point as measured, rather than a wrong one"
    FEW = "hardly any point as measured"
    ALL = "all points, as without a fault"


@dataclass(frozen=True)
class Expected:
    """The result a scenario must have; refusal is the counter in health that names the reason."""

    during: During
    refusal: str = ""
    # Half a second after it; RMS of all landmarks without lag, mm.
    within_mm: float = 3.0


@dataclass(frozen=True)
class Plan:
    """A fault: which camera (None: all), for how long, what happens to its frames."""

    about: str
    camera: str | None
    lasts_s: float
    change: Change
    expected: Expected


class Scenario(Enum):
    """Issue 4's list and its variations."""

    CAMERA_STOPS = Plan(
        "the right camera stops and returns", "right", 2.0, lost, Expected(During.NOTHING)
    )
    REFERENCE_CAMERA_STOPS = Plan(
        "the left camera, whose frames set the output schedule, stops and returns",
        "left",
        2.0,
        lost,
        Expected(During.NOTHING),
    )
    CLOCK_AHEAD = Plan(
        "the right camera's clock jumps 1 s ahead and back",
        "right",
        2.0,
        later(1.0),
        Expected(During.NOTHING, "astray"),
    )
    CLOCK_BACK = Plan(
        "the left camera's clock jumps 1 s back and ahead",
        "left",
        2.0,
        later(-1.0),
        Expected(During.NOTHING, "astray"),
    )
    CLOCK_SET = Plan(
        "the right clock jumps 1 s for a second only",
        "right",
        1.0,
        later(1.0),
        Expected(During.NOTHING, "astray"),
    )
    OTHER_CENTURY = Plan(
        "the left camera's stamps are of another century",
        "left",
        2.0,
        later(2.2e9),
        Expected(During.NOTHING, "astray"),
    )
    MIRRORED = Plan(
        "the right view is mirrored by a wrong setting",
        "right",
        2.0,
        mirrored,
        Expected(During.FEW),
    )
    NAMES_SWAP = Plan(
        "two markers swap names in two frames",
        "left",
        0.034,
        swapped,
        # Tips that were taken for each other seem to have jumped by themselves, and a hand of which
        # fingers do so is told by lively models for a while: 3.5 mm, within its sigma.
        Expected(During.ALL, within_mm=4.5),
    )
    NETWORK_PAUSE = Plan(
        "nothing arrives for five seconds", None, 5.0, lost, Expected(During.NOTHING)
    )
    OTHER_SIZE = Plan(
        "the right camera runs at another resolution than its calibration",
        "right",
        2.0,
        lambda frame: replace(frame, size_px=(1280, 960)),
        Expected(During.NOTHING, "wrong_size"),
    )
    STRANGER = Plan(
        "frames of a camera that the rig does not have",
        "right",
        2.0,
        lambda frame: replace(frame, camera="door"),
        Expected(During.NOTHING, "unknown_camera"),
    )


def edited(given: list[MarkerFrame], plan: Plan) -> list[MarkerFrame]:
    """The frames that arrive."""
    found = []
    for frame in given:
        at_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
        hit = BEGIN_S <= at_s < BEGIN_S + plan.lasts_s and plan.camera in (None, frame.camera)
        changed = plan.change(frame) if hit else frame
        found += [changed] if changed is not None else []
    return found


@pytest.mark.parametrize("scenario", Scenario, ids=lambda scenario: scenario.name.lower())
def test_scenario(scenario, run_fusion):
    plan = scenario.value
    end_s = BEGIN_S + plan.lasts_s
    step, reported = run_fusion(SETUP, edited(frames(SETUP, MOVING, end_s + AFTER_S), plan), MOVING)
    assert reported.share(end_s + RECOVERY_S, end_s + AFTER_S - 0.1) > 0.95
    assert reported.rms_mm(end_s + RECOVERY_S, end_s + AFTER_S) < plan.expected.within_mm
    # hold_s is .15 s, and a track needs a moment to be dropped; a fault of one frame has no such
    # stretch.
    stretch = (BEGIN_S, end_s) if plan.expected.during is During.ALL else (BEGIN_S + 0.3, end_s)
    match plan.expected.during:
        case During.NOTHING:
            # What one camera still sees is told as predicted, with a sigma along its ray.
            assert reported.share(*stretch, measured=True) == 0.0
        case During.FEW:
            # A mirrored view can look sound for a moment: rays meet, sizes fit. Hardly ever, and
            # never as a whole hand.
            assert reported.share(*stretch, measured=True) < 0.15
        case During.ALL:
            assert reported.share(BEGIN_S, BEGIN_S + 0.5) > 0.9
    if plan.expected.during is not During.FEW:
        assert reported.outlier_share() < 0.005
    assert not step.mirrors.mirrored
    if plan.expected.refusal:
        assert step.refusals[plan.expected.refusal] > 20


class Disorder(Enum):
    """How frames may arrive all the time: places late at most, and share that comes twice."""

    TWICE = (0.0, 0.3)
    OUT_OF_ORDER = (3.0, 0.0)
    BOTH = (3.0, 0.2)


@pytest.mark.parametrize("disorder", Disorder, ids=lambda disorder: disorder.name.lower())
def test_disorder(disorder, run_fusion):
    """Expected: the points that are reported are right.

    A late frame of the reference camera gives no output of its own any more.
    """
    places, twice = disorder.value
    given, random = frames(SETUP, MOVING, 5.0), np.random.default_rng(0)
    order = np.argsort(
        np.arange(len(given)) + random.uniform(0.0, places, len(given)), kind="stable"
    )
    arriving = [given[k] for k in order for _ in range(2 if random.random() < twice else 1)]
    step, reported = run_fusion(SETUP, arriving, MOVING)
    assert reported.share(1.0, 4.9) > (0.95 if places == 0.0 else 0.8)
    assert reported.rms_mm(1.0, 5.0) < (3.0 if places == 0.0 else 5.0)
    assert reported.outlier_share() < 0.005
    assert (step.refusals["twice"] > 30) == (twice > 0.0)
