"""`--offset CAM=SECONDS`: what is valid, and what is told of the rest."""

from __future__ import annotations

import pytest

from rhot.errors import ConfigError
from services.cli.offline.clocks.by_hand import offsets_of


def test_offsets_by_camera():
    given = offsets_of(["right=0.5", "top=-7.3"], ["left", "right", "top"])
    assert given == {"right": 0.5, "top": -7.3}
    assert offsets_of([], ["left"]) == {}


@pytest.mark.parametrize(
    ("texts", "cameras", "error"),
    [
        (["right=0.5"], ["left"], "only 'left'"),
        (["up=1"], ["left", "right"], r"no recording of a camera 'up'; there are \['right'\]"),
        (["left=1"], ["left", "right"], "others are measured against; give the offset of 'right'"),
        (["0.5"], ["left", "right"], "e.g. right=0.5"),
        (["right=nan"], ["left", "right"], "seconds as a number"),
        (["right=inf"], ["left", "right"], "seconds as a number"),
        (["right=soon"], ["left", "right"], "seconds as a number"),
        (["right=1", "right=2"], ["left", "right"], "given twice"),
    ],
)
def test_what_is_not_valid_says_what_is(texts, cameras, error):
    with pytest.raises(ConfigError, match=error):
        offsets_of(texts, cameras)
