"""Which pose an instant's points rest on depends on stamps, not on when poses arrive."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.hand import default_hand
from rhot.messages import HandPose
from services.fusion.output.pose_feedback import POSE_DELAY_NS, PoseFeedback
from services.fusion.step import FusionStep
from services.solver.step import SolverStep
from testing.synthetic_points import MovingHand, SyntheticRig, frames

SETUP = SyntheticRig(loss=0.0)
# Points every 17 ms: a pose may come after those of the next instant.
FAST = SyntheticRig(loss=0.0, fps=60.0, phase_s=1.0 / 120.0)


@pytest.fixture(scope="module")
def poses() -> list[HandPose]:
    """Of a moving hand of the tables, with paint, a second of them."""
    hands = {"right": default_hand("right")}
    fusion = FusionStep(SETUP.config(), SETUP.rig(), hands)
    solver = SolverStep(RigConfig(), hands)
    points = [p for frame in frames(SETUP, MovingHand(), 1.0) for p in fusion.step(frame)]
    return [pose for one in points if (pose := solver.step(one)) is not None]


def test_poses_count_by_their_stamps(poses: list[HandPose]) -> None:
    feedback, shuffled = PoseFeedback(), poses[:12]
    np.random.default_rng(1).shuffle(shuffled)  # type: ignore[arg-type]
    for pose in shuffled:
        feedback.add(pose)
    third_ns = poses[2].stamp_ns + POSE_DELAY_NS
    assert feedback.take(third_ns - 1) == poses[:2]
    assert feedback.take(third_ns) == poses[2:3]
    assert feedback.late == 0
    feedback.add(poses[1])
    assert feedback.late == 1
    feedback.reset()
    assert feedback.take(2 * third_ns) == []


def test_stamps_of_a_far_future_do_not_fill_the_memory(poses: list[HandPose]) -> None:
    feedback, newest_ns = PoseFeedback(), poses[0].stamp_ns
    for k in range(500):
        feedback.add(msgspec.structs.replace(poses[0], stamp_ns=newest_ns + (k + 1) * 10**12))
    feedback.add(poses[0])
    assert feedback.take(newest_ns + POSE_DELAY_NS) == [poses[0]]
    assert len(feedback.take(2**62)) < 100


@pytest.mark.parametrize("late_frames", [1, 3])
def test_points_do_not_depend_on_when_a_pose_comes(poses: list[HandPose], late_frames: int) -> None:
    """Poses that come at once, or frames later but in time, give the same points."""
    hands = {"right": default_hand("right")}
    found = []
    for late in (0, late_frames):
        fusion = FusionStep(FAST.config(), FAST.rig(), hands)
        solver = SolverStep(RigConfig(), hands)
        waiting: list[tuple[int, HandPose]] = []
        points = []
        for number, frame in enumerate(frames(FAST, MovingHand(), 1.0)):
            # 8 ms from frame to frame.
            while waiting and waiting[0][0] <= number:
                fusion.note_pose(waiting.pop(0)[1])
            for one in fusion.step(frame):
                points.append(one)
                pose = solver.step(one)
                if pose is not None:
                    waiting.append((number + late, pose))
        assert fusion.late_poses == 0
        found.append(points)
    assert found[0] == found[1]
    assert len(found[0]) > 40
