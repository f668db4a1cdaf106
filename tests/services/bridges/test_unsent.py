"""Each pose goes out once."""

from __future__ import annotations

import msgspec

from services.bridges.pacing import Frame
from services.bridges.unsent import Unsent
from testing.sample_hands import object_pose, random_pose


def test_what_came_again_is_not_sent_again():
    unsent, pose, cup = Unsent(), random_pose("left", 1), object_pose("cup")
    frame = Frame(0.0, {"left": pose}, {"cup": cup})
    assert (unsent.hands(frame), unsent.objects(frame)) == ([pose], [cup])
    moved = msgspec.structs.replace(cup, seq=1)
    frame = Frame(0.1, {"left": pose}, {"cup": moved})
    assert (unsent.hands(frame), unsent.objects(frame)) == ([], [moved])
    # Lost, and found again with the same numbers: a recording that begins anew.
    assert unsent.hands(Frame(0.2, {}, {})) == []
    assert unsent.hands(frame) == [pose]
