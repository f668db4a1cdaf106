"""Which joint is lit for a part of the hand."""

from __future__ import annotations

from typing import get_args

from rhot.hand import JOINTS
from rhot.messages.objects import HandPart
from services.viewer.scene.touches import joint_of


def test_every_part_has_a_joint_of_its_own() -> None:
    lit = {part: JOINTS[joint_of(part)] for part in get_args(HandPart)}
    assert lit["index"] == "index_tip"
    assert lit["palm"] == "palm"
    assert len(set(lit.values())) == 6
