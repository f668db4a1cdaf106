"""Places in pictures, as text."""

from __future__ import annotations

import pytest

from rhot.errors import CalibrationError
from services.cli.calibrate.pointing_options import PointingOptions, frame_numbers
from services.pi_tracker.colors.pointer import Pointer


def test_boxes_and_clicks_count_in_every_picture():
    found = PointingOptions(box=["green=1,2,30,40"], click=["blue=5.5,6"]).in_every_frame(
        range(2, 4)
    )
    assert found == [
        Pointer("green", 2, 1.0, 2.0, 30.0, 40.0),
        Pointer("blue", 2, 5.5, 6.0),
        Pointer("green", 3, 1.0, 2.0, 30.0, 40.0),
        Pointer("blue", 3, 5.5, 6.0),
    ]


def test_places_in_single_frames_number_the_frames():
    frames, pointers = PointingOptions(
        at=["100:green=1,2,3,4", "7:blue=5,6", "100:blue=8,9"]
    ).in_single_frames()
    assert frames == [100, 7]
    assert [(p.frame, p.color) for p in pointers] == [(0, "green"), (1, "blue"), (0, "blue")]


@pytest.mark.parametrize(
    "text",
    [
        "green",
        "green=",
        "green=1",
        "green=1,2,3",
        "green=a,b",
        "gr een=1,2",
        "=1,2",
        "green=1,2,3,4,5",
        "green=nan,1",
    ],
)
def test_what_is_no_click_says_what_one_is(text):
    with pytest.raises(CalibrationError, match=r"expected color=x,y"):
        PointingOptions(click=[text]).in_every_frame(range(1))


@pytest.mark.parametrize(
    "text", ["green=1,2", "green=1,2,0,4", "green=1,2,3,-4", "green=1,2,1e9,4"]
)
def test_what_is_no_box_says_what_one_is(text):
    with pytest.raises(CalibrationError, match=r"expected color=x,y,width,height|must be above 0"):
        PointingOptions(box=[text]).in_every_frame(range(1))


@pytest.mark.parametrize("text", ["green=1,2", "x:green=1,2", "-1:green=1,2", "3:green"])
def test_what_is_no_place_in_a_frame_says_what_one_is(text):
    with pytest.raises(CalibrationError, match=r"expected (FRAME:)?color="):
        PointingOptions(at=[text]).in_single_frames()


def test_any_way_of_pointing_counts():
    assert not PointingOptions()
    assert not PointingOptions(box=[])
    for used in (PointingOptions(click=["green=1,2"]), PointingOptions(auto=True)):
        assert used


def test_frame_numbers():
    assert frame_numbers("10, 200,10") == [10, 200]
    with pytest.raises(CalibrationError, match="expected frame numbers"):
        frame_numbers("1,x")
