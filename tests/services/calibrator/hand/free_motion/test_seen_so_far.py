"""What a hand has shown so far is what the estimate will say of the same messages."""

from __future__ import annotations

import msgspec
import pytest

from rhot.hand import DIGITS, default_hand
from services.calibrator.hand.free_motion.frames import seen_frames
from services.calibrator.hand.free_motion.seen_so_far import SeenSoFar


def test_it_agrees_with_the_frames_of_the_whole_recording(random_motion) -> None:
    table = default_hand("right")
    messages = [message for message, _ in random_motion(table, 600, 4)]
    # A second in which the wrist is covered, and one in which the hand was away.
    for row in range(100, 130):
        points = [one for one in messages[row].points if one.name != "wrist"]
        messages[row] = msgspec.structs.replace(messages[row], points=points)
    del messages[300:330]
    so_far = SeenSoFar()
    assert so_far.not_bent() == DIGITS[1:]
    for message in messages:
        so_far.add(message)
    seen = seen_frames(messages, table)
    assert so_far.seconds == pytest.approx(seen.seconds, abs=1e-6)
    assert so_far.not_bent() == seen.not_bent
    assert so_far.missing == ()
    assert so_far.messages == len(messages)
