"""No jump without motion: recorded hands with all their points, right and wrong bones, thinned out,
exact and with a millimetre of noise. `benchmarks/solver_jumps.py` has more of it, and gaps.

A jump is a change of more than 20 deg between two messages, of the wrist's orientation or of any
joint, beyond what the recording itself does.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, angle_between, rotation_from_quaternion
from rhot.hand import DIGITS, HandModel, default_hand
from rhot.messages import HandPoint, HandPoints
from services.simulator.recorded_motion.bones import DrivenHand, driven_hand
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints
from services.solver.step import SolverStep

RECORDINGS = ("grab", "HandSplay-110fps", "pinch", "wave")
JUMP_RAD = np.deg2rad(20.0)
# The wrist marker behind the palm's centre, and the palm's centre itself.
BEHIND_M = {"wrist": 0.06, "palm": 0.0}


def _models(hand: DrivenHand, palm_m: Array, marker: str) -> dict[str, HandModel]:
    """The recorded hand, and the tables' at its size; tips are the ends of bones.

    palm_m (3,): the palm's centre in the wrist frame.
    """
    place = tuple((palm_m + np.array([0.0, 0.0, BEHIND_M[marker]])).tolist())

    def painted(model: HandModel) -> HandModel:
        paint = {
            name: msgspec.structs.replace(dab, offset_m=(0.0, 0.0, 0.0))
            for name, dab in model.paint.items()
        }
        paint["wrist"] = msgspec.structs.replace(paint["wrist"], offset_m=place)
        return msgspec.structs.replace(model, paint=paint)

    size = float(hand.model.lengths_m[1:].sum() / default_hand().lengths_m[1:].sum())
    return {"own": painted(hand.model), "tables": painted(default_hand(hand.hand, size))}


def _turns(rotations: Array) -> Array:
    return np.array([angle_between(a, b) for a, b in itertools.pairwise(rotations)])


@pytest.mark.parametrize(("every", "noise_m"), [(1, 0.0), (4, 0.0), (2, 1e-3)])
@pytest.mark.parametrize("bones", ["own", "tables"])
@pytest.mark.parametrize("marker", list(BEHIND_M))
@pytest.mark.parametrize("name", RECORDINGS)
def test_no_jump_without_motion(
    rhot_data: Path,
    angles_of: Callable,
    name: str,
    marker: str,
    bones: str,
    every: int,
    noise_m: float,
) -> None:
    recorded = load_recording(rhot_data / f"hand_motion/leap/{name}.csv")
    assert isinstance(recorded, RecordedJoints)
    recorded = recorded.rows(np.arange(0, len(recorded.times_s), every))
    hand = driven_hand(recorded)
    assert isinstance(hand, DrivenHand)
    palm_m = hand.rotations[0].T @ (recorded.origin_m[0] - hand.wrist_m[0])
    step = SolverStep(RigConfig(), {hand.hand: _models(hand, palm_m, marker)[bones]})
    markers_m = recorded.origin_m + BEHIND_M[marker] * recorded.axes[:, :, 2]
    noise = np.random.default_rng([1, 5]).normal(0.0, noise_m, (len(markers_m), 6, 3))
    poses = []
    for frame, time_s in enumerate(hand.times_s):
        tips = zip((f"{d}_tip" for d in DIGITS), recorded.joints_m[frame, :, 3], strict=True)
        points = [
            HandPoint(
                name=landmark,
                position_m=tuple((place + off).tolist()),
                sigma_m=(1e-3,) * 3,
                cameras=[],
                source="measured",
            )
            for (landmark, place), off in zip(
                (("wrist", markers_m[frame]), *tips), noise[frame], strict=True
            )
        ]
        stamp_ns = 10**18 + round(1e9 * time_s)
        poses.append(step.step(HandPoints(hand=hand.hand, seq=0, stamp_ns=stamp_ns, points=points)))
    rotations = np.array([rotation_from_quaternion(p.wrist.orientation_wxyz) for p in poses])
    moved = np.abs(np.diff(hand.angles_rad, axis=0)).max(axis=2, keepdims=True)
    bent = np.abs(np.diff([angles_of(pose) for pose in poses], axis=0))
    assert not np.any(bent > JUMP_RAD + moved)
    assert not np.any(_turns(rotations) > JUMP_RAD + _turns(hand.rotations))
