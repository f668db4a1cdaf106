"""What a calibration session remembers, shows and saves."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.camera_messages import ColorRange, Colors, FitResult, Patch
from services.viewer.calibration import text
from services.viewer.calibration.model import Session
from services.viewer.calibration.picture import decoded, mask_of, shown

OLD = ColorRange(hsv_low=(40, 90, 40), hsv_high=(60, 255, 255))
NEW = ColorRange(hsv_low=(45, 90, 40), hsv_high=(65, 255, 255))
PICTURE = "0123456789abcdef"


@pytest.fixture
def session() -> Session:
    return Session("left", ["green", "blue", "cyan"], Colors(colors={"green": OLD}))


def pointed(session: Session, color: str) -> None:
    session.point(color, PICTURE, 10.0, 20.0)
    assert session.take(FitResult(colors={one.color: NEW for one in session.pointed}))


def test_ranges_in_force_give_way_to_fitted_and_those_to_edited_ones(session: Session) -> None:
    assert not session.changed
    assert session.missing == ["blue", "cyan"]
    pointed(session, "green")
    assert session.ranges["green"] == NEW
    session.edit("green", OLD)
    assert session.ranges["green"] == OLD
    # Pointing again fits again.
    pointed(session, "green")
    assert session.ranges["green"] == NEW
    assert session.changed


def test_the_next_colour_is_one_nobody_pointed_at(session: Session) -> None:
    pointed(session, "blue")
    assert session.next_after("blue") == "cyan"
    pointed(session, "cyan")
    assert session.next_after("cyan") == "green"
    pointed(session, "green")
    assert session.next_after("green") == "green"


def test_a_click_that_shows_no_paint_is_forgotten(session: Session) -> None:
    pointed(session, "blue")
    session.point("cyan", PICTURE, 1.0, 1.0)
    assert not session.take(FitResult(error="grey"))
    assert session.error == "grey"
    assert [one.color for one in session.pointed] == ["blue"]
    session.point("cyan", PICTURE, 1.0, 1.0)
    assert not session.take(None)
    assert "does not answer" in session.error


def test_undo_and_start_over(session: Session) -> None:
    pointed(session, "blue")
    pointed(session, "cyan")
    session.undo()
    assert [one.color for one in session.request().pointed] == ["blue"]
    session.undo()
    session.undo()
    assert session.ranges == {"green": OLD}
    session.edit("green", NEW)
    session.reset()
    assert session.ranges == {"green": OLD}


def test_a_proposal_counts_as_pointing_at_the_rigs_colours(session: Session) -> None:
    patches = [
        Patch(color=color, picture=PICTURE, box_px=(1, 2, 3, 4)) for color in ("blue", "orange")
    ]
    assert session.take_proposal(FitResult(colors={"blue": NEW, "orange": NEW}, patches=patches))
    assert set(session.ranges) == {"green", "blue"}
    assert [one.color for one in session.pointed] == ["blue"]
    assert not session.take_proposal(FitResult(error="nothing stands out"))


def test_what_is_saved_says_how_it_was_made(session: Session) -> None:
    pointed(session, "blue")
    session.edit("green", NEW)
    made = session.file("2026-01-01")
    assert (made.date, made.tool) == ("2026-01-01", "rhot viewer")
    assert made.inputs == {"places": ["blue=10,20"], "by_hand": ["green"]}
    session.was_saved(made)
    assert not session.changed
    assert "in force on camera left" in text.verdict(session)


def test_the_page_says_what_comes_next(session: Session) -> None:
    def says(color: str) -> str:
        return text.to_do(session, color, pictures=True)

    assert "click the middle of the green marker" in says("green")
    pointed(session, "green")
    assert "Click again where its mask has holes" in says("green")
    for color in ("blue", "cyan"):
        pointed(session, color)
    assert "put them in force" in says("cyan")
    session.was_saved(session.file("2026-01-02T03:04:05.678+00:00"))
    session.next_camera = "right"
    assert "This camera is done. Now <b>camera right</b>" in says("cyan")
    assert text.verdict(session).count("03:04:05<") == 1
    session.next_camera = ""
    assert "to see the hand" in says("cyan")


def test_texts_escape_and_survive_whatever_the_network_says(session: Session) -> None:
    session.point("green", PICTURE, 1.0, 1.0)
    odd = {
        "colors": {"green": {"inside": "x", "skin": 1e300}, "blue": 7},
        "separation": {"green/blue": 3, "a": {"d": "no"}, "green/cyan": {"d": 1e308}},
    }
    session.take(
        FitResult(
            colors={"green": NEW, "blue": NEW},
            residuals=odd,
            warnings=["<script>"] * 50,
            notes=["<i>"],
        )
    )
    html = text.report(session)
    assert "<script>" not in html
    assert html.count("&lt;script&gt;") == 8
    assert "cyan, d' 999.0" in html
    session.error = "<img>"
    assert "<img>" not in text.to_do(session, "green", pictures=True)
    assert "waiting for a picture" in text.to_do(session, "green", pictures=False)


def test_without_a_hand_the_colours_in_force_are_offered() -> None:
    assert Session("left", [], Colors(colors={"b": OLD, "a": OLD})).names == ["a", "b"]
    assert Session("left", []).names == ["green"]


def test_masks_are_painted_over_the_picture_and_wrap_through_red() -> None:
    bgr = np.full((60, 80, 3), 128, np.uint8)
    bgr[20:40, 20:40] = (20, 20, 200)
    red = ColorRange(hsv_low=(170, 100, 40), hsv_high=(10, 255, 255))
    mask = mask_of(cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV), red)
    rows, columns = np.nonzero(mask)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (20, 39, 20, 39)
    patch = Patch(color="red", picture=PICTURE, box_px=(20, 20, 20, 20))
    rgb = shown(bgr, {"red": red}, {"red": (255, 0, 255)}, "red", [patch], masks=True)
    assert rgb[30, 30, 2] > 180
    assert tuple(rgb[16, 30]) == (255, 255, 255)
    assert np.array_equal(shown(bgr, {"red": red}, {}, "red", [], masks=False), bgr[:, :, ::-1])


def test_bytes_that_are_no_picture_are_none() -> None:
    assert decoded(b"") is None
    assert decoded(b"\x89PNG nonsense") is None
