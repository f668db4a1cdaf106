"""--seed: whose dot, in which camera's first picture; wrong ones are told what is valid."""

from __future__ import annotations

import pytest

from rhot.errors import ConfigError
from rhot.files.config import RigConfig, with_joints
from rhot.files.rig_tables import HandTable
from services.cli.offline.seeds import seeds_of

CONFIG = with_joints(RigConfig(hand={"right": HandTable(joints="red", fingers=("index",))}))


def test_seeds_belong_to_a_camera_and_a_landmark() -> None:
    assert seeds_of(["index_tip=512,300.5"], CONFIG, ["side"]) == {
        "side": {"index_tip": (512.0, 300.5)}
    }
    both = ["left:index_tip=1,2", "right:index_tip=3,4", "left:index_distal=5,6"]
    assert seeds_of(both, CONFIG, ["left", "right"]) == {
        "left": {"index_tip": (1.0, 2.0), "index_distal": (5.0, 6.0)},
        "right": {"index_tip": (3.0, 4.0)},
    }
    assert seeds_of([], RigConfig(), ["left"]) == {"left": {}}


@pytest.mark.parametrize(
    ("texts", "cameras", "says"),
    [
        (["index_tip=1,2"], ["left", "right"], "e.g. left:index_tip=1,2"),
        (["top:index_tip=1,2"], ["left"], "no recording of a camera 'top'"),
        (["index_tpi=1,2"], ["left"], "did you mean 'index_tip'"),
        (["thumb_tip=1,2"], ["left"], "no landmark whose colour others share"),
        (["index_tip=1"], ["left"], "place in the picture in px"),
        (["index_tip"], ["left"], "place in the picture in px"),
        (["index_tip=-1,2"], ["left"], "place in the picture in px"),
        (["index_tip=nan,2"], ["left"], "place in the picture in px"),
        (["index_tip=1,2", "index_tip=3,4"], ["left"], "given twice"),
    ],
)
def test_a_wrong_seed_is_told(texts: list[str], cameras: list[str], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        seeds_of(texts, CONFIG, cameras)


def test_seeds_need_dots_that_share_a_colour() -> None:
    with pytest.raises(ConfigError, match='joints = "red"'):
        seeds_of(["index_tip=1,2"], RigConfig(), ["left"])
