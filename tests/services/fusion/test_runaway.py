"""Hands that turn sharply: a marker that both cameras see is never lost, nor told metres off.

Each of these motions made tracks run away, or lost them, while all models shared one gate and the
liveliest one's velocity lasted: 345 mm on the recorded grasp, 52 to 187 mm on stop-and-go.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from services.fusion.step import FusionStep
from testing.families.motions import flapping, stop_and_go, tapping
from testing.families.points import Gaps, point_case, with_gaps
from testing.families.recordings import leap_motion
from testing.point_errors import PointErrors, point_errors
from testing.synthetic_points import Motion, MovingHand, SyntheticRig, frames

RECORDED = Path(os.environ.get("RHOT_DATA", "/nonexistent")) / "hand_motion" / "leap"
real = pytest.mark.skipif(not RECORDED.is_dir(), reason="needs RHOT_DATA with Leap recordings")
# Clocks as announced: what the tuner makes of such motion is a matter of its own.
CLOCKS_KNOWN = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4)


def largest_error_mm(found: PointErrors) -> float:
    return 1e3 * float(np.linalg.norm(found.errors_m, axis=1).max())


def share(found: PointErrors) -> float:
    """The share of landmarks that are told, of all instants with a message."""
    return len(found.instants_s) / (6.0 * len(np.unique(found.instants_s)))


def share_beyond(found: PointErrors, sigmas: float) -> float:
    return float(np.mean((np.abs(found.errors_m) > sigmas * found.sigmas_m).any(axis=1)))


@pytest.mark.parametrize(
    ("motion_of", "largest_mm"),
    [
        (lambda: stop_and_go(20.0, seed=12), 25.0),
        (lambda: flapping(2.0, 30.0, seed=7), 27.0),
        pytest.param(lambda: leap_motion("grab"), 36.0, marks=real),
        pytest.param(lambda: leap_motion("wave"), 45.0, marks=real),
    ],
    ids=["stop and go", "flapping", "grasp", "wave"],
)
def test_no_track_runs_away(run, motion_of: Callable[[], Motion], largest_mm: float):
    """Expected: no track is lost; the largest error with two frames of lag, as measured and a half.

    Without any lag a landmark is within five of its sigmas in 99.5 % of instants.
    """
    motion = motion_of()
    step, smoothed = run(CLOCKS_KNOWN, motion, Fusion(lag_frames=2, tune_clocks=False))
    assert step.method.counts.dropped == 0
    assert share(smoothed) > 0.995
    assert largest_error_mm(smoothed) < largest_mm
    _, at_once = run(CLOCKS_KNOWN, motion, Fusion(tune_clocks=False))
    assert share_beyond(at_once, 5.0) < 0.005


def test_wild_markers_of_one_camera_cost_little(fuse):
    """Test: stop-and-go; of each hundredth marker of one camera the tracker sees another thing.

    Expected: no track is lost; the largest error with two frames of lag, as measured and a half.
    """
    random, motion = np.random.default_rng(6), stop_and_go(14.0, seed=2)

    def wild(marker):
        if random.random() > 0.01:
            return marker
        angle, away_px = random.uniform(0.0, 6.28), random.uniform(5.0, 50.0)
        x_px = np.clip(marker.x_px + away_px * np.cos(angle), 0.0, 639.0)
        y_px = np.clip(marker.y_px + away_px * np.sin(angle), 0.0, 479.0)
        return msgspec.structs.replace(marker, x_px=float(x_px), y_px=float(y_px))

    given = [
        msgspec.structs.replace(frame, markers=[wild(marker) for marker in frame.markers])
        if frame.camera == "left"
        else frame
        for frame in frames(CLOCKS_KNOWN, motion, 6.0)
    ]
    settings = Fusion(lag_frames=2, tune_clocks=False)
    step, messages = fuse(CLOCKS_KNOWN, given, settings)
    with_them = point_errors(messages, motion).within(1.0)
    assert step.method.counts.dropped == 0
    assert largest_error_mm(with_them) < 40.0


def test_a_finger_that_taps_stays_near_when_a_camera_misses_it():
    """Test: a hand at rest, whose fingers tap; one camera sees none of it for .3 s of every two.

    A tip whose taps made it vague began again as that camera went, with one of its looks: it was
    234 mm off. Expected: the largest error of what one camera sees, as measured and a half.
    """
    motion = tapping(4.0, 0.025, seed=1)
    case = point_case(
        "taps", motion, gaps=Gaps(blind=((1, tuple(range(6)), 1.5, 0.3),), every_s=2.0)
    )
    step = FusionStep(case.config, case.cameras, case.hands)
    told = [points for frame in case.frames for points in step.step(frame)]
    found = point_errors(told, motion).within(1.0)
    assert step.method.counts.started > 12
    assert largest_error_mm(found) < 85.0


def test_landmarks_that_their_hand_tells_do_not_begin_again(fuse):
    """Test: a hand moves smoothly; a fifth of all markers are missing, some for .2 s in a camera.

    One that was known to 4 mm began again with two looks as the other camera came back, 204 mm off;
    of these, 29 mm. Expected: each begins once; the largest error with two frames of lag, as
    measured and a half.
    """
    motion, rig = MovingHand(finger_share=0.0), SyntheticRig()
    given = with_gaps(frames(rig, motion, 12.0), Gaps(share=0.2, seed=3), rig)
    step, messages = fuse(rig, given, Fusion(lag_frames=2))
    assert step.method.counts.started == 6
    assert largest_error_mm(point_errors(messages, motion).within(1.0)) < 5.0


def test_what_nobody_sees_for_a_frame_is_not_told_metres_off():
    """Test: a camera misses a hand for a second; meanwhile the other one loses frames.

    Points at the instant of a lost frame were told as the filter had them: of other motions 7 m
    off, their sigmas metres, of this one 286 mm. Expected: the largest error, as measured and a
    half.
    """
    motion = MovingHand(speed_m_s=0.3)
    gaps = Gaps(blind=((1, tuple(range(6)), 1.5, 1.0),), every_s=2.0)
    case = point_case("lost frames", motion, SyntheticRig(loss=0.1, seed=2), gaps)
    step = FusionStep(case.config, case.cameras, case.hands)
    told = [points for frame in case.frames for points in step.step(frame)]
    assert largest_error_mm(point_errors(told, motion).within(1.0)) < 130.0


def test_a_marker_that_is_suddenly_elsewhere_is_found_within_three_frames(bench_of):
    """Test: a hand jumps by a decimetre, as both cameras see it; hold_s is a second.

    Expected: tracks start again where the rays meet, long before they would be given up.
    """
    bench = bench_of(CLOCKS_KNOWN, Fusion(hold_s=1.0))
    jump_s, away = 1.0, np.array([0.08, 0.05, 0.1])

    def motion(times_s):
        times = np.broadcast_to(np.asarray(times_s).reshape(len(times_s), -1), (len(times_s), 6))
        return MovingHand()(times_s) + np.where(times >= jump_s, 1.0, 0.0)[..., None] * away

    for frame in frames(CLOCKS_KNOWN, motion, jump_s + 0.2):
        instant_s = bench.see(frame)
        if instant_s > jump_s + 0.13:
            found = bench.method.estimate(instant_s)
            assert found.found.all()
            error = found.positions_m - motion(np.array([instant_s]))[0]
            sigma = np.sqrt(np.einsum("nii->ni", found.covariances_m2))
            assert (np.abs(error) < 5.0 * sigma).all()
            assert np.abs(error).max() < 0.03
    assert bench.method.counts.dropped == 0
