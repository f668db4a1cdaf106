"""What `rhot up` says of hands that nobody measured."""

from __future__ import annotations

from pathlib import Path

from rhot.files.calibration import save
from rhot.files.config import load_rig
from rhot.hand import default_hand
from services.cli.live.up import unmeasured_hands

RIG = """[[camera]]
name = "left"
[[camera]]
name = "right"
[hand.right.markers]
wrist = "blue"
[hand.left.markers]
wrist = "red"
"""


def test_a_hand_without_a_file_was_never_measured(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(RIG)
    rig = load_rig(tmp_path / "rig.toml")
    assert sorted(unmeasured_hands(rig)) == ["left", "right"]
    save(rig.calibration_dir / "hand.right.json", default_hand("right"))
    assert unmeasured_hands(rig) == ["left"]
