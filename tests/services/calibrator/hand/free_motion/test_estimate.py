"""A hand from free motion: nearer to the truth than the tables, and refused where it shows too
little.
"""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.hand import HandModel, default_hand
from rhot.messages import HandPoints
from services.calibrator.hand.free_motion.estimate import estimate_hand
from services.calibrator.hand.free_motion.frames import MIN_SECONDS, seen_frames
from testing.synthetic_hands import with_bone_factors

# Of the bones of each digit, beside the size.
SIZE, FACTORS = 0.85, (1.05, 0.95, 1.05, 0.95, 1.05)


def _knuckles(model: HandModel) -> np.ndarray:
    return np.array([digit.base_m for digit in model.digits[1:]])


def _moved(message: HandPoints, **changes) -> HandPoints:
    points = [
        msgspec.structs.replace(point, **{k: change(point) for k, change in changes.items()})
        for point in message.points
    ]
    return msgspec.structs.replace(message, points=points)


@pytest.fixture(scope="module", params=["right", "left"])
def free(request, random_motion):
    """A small hand and half a minute of random motion."""
    factors = np.repeat(np.array(FACTORS)[:, None], 4, axis=1)
    truth = with_bone_factors(default_hand(request.param, SIZE), factors)
    return truth, [message for message, _ in random_motion(truth, 900, 4)]


def test_knuckles_of_a_small_hand(free) -> None:
    truth, messages = free
    table = default_hand(truth.hand)
    seen = seen_frames(messages, table)
    found = estimate_hand(seen, table)
    errors = np.linalg.norm(_knuckles(found.model) - _knuckles(truth), axis=1)
    before = np.linalg.norm(_knuckles(table) - _knuckles(truth), axis=1)
    assert np.median(errors) < 6e-3 < np.median(before)
    assert found.residual_m < 2e-3


def test_lengths_measured_by_hand_stay(free) -> None:
    truth, messages = free
    table = default_hand(truth.hand)
    found = estimate_hand(seen_frames(messages, table), table, {(1, 0): 0.037})
    assert found.model.digits[1].lengths_m[0] == pytest.approx(0.037)


def test_what_shows_too_little(free) -> None:
    truth, messages = free
    table, few = default_hand(truth.hand), messages[:200]
    with pytest.raises(CalibrationError, match=rf"{MIN_SECONDS:.0f} s are needed"):
        seen_frames(few, table)
    with pytest.raises(CalibrationError, match="no measured wrist"):
        seen_frames(
            [_moved(m, name=lambda p: p.name.replace("wrist", "palm")) for m in messages], table
        )
    metres = [
        _moved(m, position_m=lambda p: tuple(10.0 * v for v in p.position_m)) for m in messages
    ]
    with pytest.raises(CalibrationError, match="points in metres"):
        seen_frames(metres, table)
    with pytest.raises(CalibrationError, match="two recordings in one"):
        seen_frames(messages + messages, table)
    still = [msgspec.structs.replace(messages[0], seq=m.seq, stamp_ns=m.stamp_ns) for m in messages]
    with pytest.raises(CalibrationError, match="held still"):
        seen_frames(still, table)
