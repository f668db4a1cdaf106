"""What the calibration of a camera's colours remembers, shows and saves."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.messages.camera import ColorRange, Colors, FitResult, Patch
from services.viewer.calibration import text
from services.viewer.calibration.model import ColorCalibration
from services.viewer.calibration.picture import annotated, decoded, mask_of

OLD = ColorRange(hsv_low=(40, 90, 40), hsv_high=(60, 255, 255))
NEW = ColorRange(hsv_low=(45, 90, 40), hsv_high=(65, 255, 255))
PICTURE = "0123456789abcdef"


@pytest.fixture
def calibration() -> ColorCalibration:
    return ColorCalibration("left", ["green", "blue", "cyan"], Colors(colors={"green": OLD}))


def click_and_fit(calibration: ColorCalibration, color: str) -> None:
    calibration.click(color, PICTURE, 10.0, 20.0)
    assert calibration.take_fit(
        FitResult(colors={click.color: NEW for click in calibration.clicks})
    )


def test_applied_ranges_give_way_to_fitted_and_those_to_edited_ones(
    calibration: ColorCalibration,
) -> None:
    assert not calibration.changed
    assert calibration.missing == ["blue", "cyan"]
    click_and_fit(calibration, "green")
    assert calibration.ranges["green"] == NEW
    calibration.edit("green", OLD)
    assert calibration.ranges["green"] == OLD
    # Pointing again fits again.
    click_and_fit(calibration, "green")
    assert calibration.ranges["green"] == NEW
    assert calibration.changed


def test_the_next_colour_is_one_nobody_pointed_at(calibration: ColorCalibration) -> None:
    click_and_fit(calibration, "blue")
    assert calibration.next_to_click("blue") == "cyan"
    click_and_fit(calibration, "cyan")
    assert calibration.next_to_click("cyan") == "green"
    click_and_fit(calibration, "green")
    assert calibration.next_to_click("green") == "green"


def test_a_click_that_shows_no_paint_is_forgotten(calibration: ColorCalibration) -> None:
    click_and_fit(calibration, "blue")
    calibration.click("cyan", PICTURE, 1.0, 1.0)
    assert not calibration.take_fit(FitResult(error="grey"))
    assert calibration.error == "grey"
    assert [click.color for click in calibration.clicks] == ["blue"]
    calibration.click("cyan", PICTURE, 1.0, 1.0)
    assert not calibration.take_fit(None)
    assert "does not answer" in calibration.error


def test_undo_and_start_over(calibration: ColorCalibration) -> None:
    click_and_fit(calibration, "blue")
    click_and_fit(calibration, "cyan")
    calibration.undo()
    assert [click.color for click in calibration.request().pointed] == ["blue"]
    calibration.undo()
    calibration.undo()
    assert calibration.ranges == {"green": OLD}
    calibration.edit("green", NEW)
    calibration.reset()
    assert calibration.ranges == {"green": OLD}


def test_a_proposal_counts_as_pointing_at_the_rigs_colours(calibration: ColorCalibration) -> None:
    patches = [
        Patch(color=color, picture=PICTURE, box_px=(1, 2, 3, 4)) for color in ("blue", "orange")
    ]
    assert calibration.take_proposal(
        FitResult(colors={"blue": NEW, "orange": NEW}, patches=patches)
    )
    assert set(calibration.ranges) == {"green", "blue"}
    assert [click.color for click in calibration.clicks] == ["blue"]
    # What was not found is to be clicked on.
    assert [calibration.next_to_click(color) for color in ("blue", "green")] == ["cyan", "green"]
    assert not calibration.take_proposal(FitResult(error="nothing stands out"))


def test_what_is_saved_says_how_it_was_made(calibration: ColorCalibration) -> None:
    click_and_fit(calibration, "blue")
    calibration.edit("green", NEW)
    made = calibration.as_file("2026-01-01")
    assert (made.date, made.tool) == ("2026-01-01", "rhot-viewer")
    assert made.inputs == {"places": ["blue=10,20"], "by_hand": ["green"]}
    calibration.was_applied(made)
    assert not calibration.changed
    assert "applied on camera left" in text.status(calibration)


def test_the_page_says_what_comes_next(calibration: ColorCalibration) -> None:
    def says(color: str) -> str:
        return text.to_do(calibration, color, pictures=True)

    assert "click the middle of the green marker" in says("green")
    click_and_fit(calibration, "green")
    assert "Click again where its mask has holes" in says("green")
    for color in ("blue", "cyan"):
        click_and_fit(calibration, color)
    assert "press <b>apply</b>" in says("cyan")
    calibration.was_applied(calibration.as_file("2026-01-02T03:04:05.678+00:00"))
    calibration.next_camera = "right"
    assert "This camera is done. Now <b>camera right</b>" in says("cyan")
    assert text.status(calibration).count("03:04:05<") == 1
    calibration.next_camera = ""
    assert "Go on with the next step" in says("cyan")


def test_texts_escape_and_survive_whatever_the_network_says(calibration: ColorCalibration) -> None:
    calibration.click("green", PICTURE, 1.0, 1.0)
    odd = {
        "colors": {"green": {"inside": "x", "skin": 1e300}, "blue": 7},
        "separation": {"green/blue": 3, "a": {"d": "no"}, "green/cyan": {"d": 1e308}},
    }
    calibration.take_fit(
        FitResult(
            colors={"green": NEW, "blue": NEW},
            residuals=odd,
            warnings=["<script>"] * 50,
            notes=["<i>"],
        )
    )
    html = text.report(calibration)
    assert "<script>" not in html
    assert html.count("&lt;script&gt;") == 8
    assert "cyan, d' 999.0" in html
    calibration.error = "<img>"
    assert "<img>" not in text.to_do(calibration, "green", pictures=True)
    assert "waiting for a picture" in text.to_do(calibration, "green", pictures=False)


def test_without_a_hand_the_applied_colours_are_offered() -> None:
    assert ColorCalibration("left", [], Colors(colors={"b": OLD, "a": OLD})).names == ["a", "b"]
    assert ColorCalibration("left", []).names == ["green"]


def test_masks_are_painted_over_the_picture_and_wrap_through_red() -> None:
    bgr = np.full((60, 80, 3), 128, np.uint8)
    bgr[20:40, 20:40] = (20, 20, 200)
    red = ColorRange(hsv_low=(170, 100, 40), hsv_high=(10, 255, 255))
    mask = mask_of(cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV), red)
    rows, columns = np.nonzero(mask)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (20, 39, 20, 39)
    patch = Patch(color="red", picture=PICTURE, box_px=(20, 20, 20, 20))
    rgb = annotated(bgr, {"red": red}, {"red": (255, 0, 255)}, "red", [patch], masks=True)
    assert rgb[30, 30, 2] > 180
    assert tuple(rgb[16, 30]) == (255, 255, 255)
    assert np.array_equal(annotated(bgr, {"red": red}, {}, "red", [], masks=False), bgr[:, :, ::-1])


def test_bytes_that_are_no_picture_are_none() -> None:
    assert decoded(b"") is None
    assert decoded(b"\x89PNG nonsense") is None
