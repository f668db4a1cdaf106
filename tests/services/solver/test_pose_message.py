"""Building the message: where joints come from."""

from __future__ import annotations

from rhot.hand import JOINT_INDEX
from services.solver.pose_message import joint_sources


def test_sources() -> None:
    found = joint_sources(
        {"wrist", "index_tip", "middle_proximal"}, True, [False, True, True, False, False]
    )
    at = {name: found[JOINT_INDEX[name]] for name in JOINT_INDEX}
    assert at["wrist"] == at["index_tip"] == at["middle_proximal"] == "measured"
    assert (
        at["palm"]
        == at["index_distal"]
        == at["middle_tip"]
        == at["ring_proximal"]
        == at["thumb_metacarpal"]
        == "solved"
    )
    assert at["ring_distal"] == at["thumb_tip"] == "predicted"
    assert set(joint_sources(set(), False, [True] * 5)) == {"predicted"}
