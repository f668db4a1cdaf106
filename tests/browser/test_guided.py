"""A guided calibration in a real browser, from the first picture of a board to the saved lens: real
viewer and calibrator processes, and a camera that shows rendered boards; and one that is practised,
where the simulator carries the board before its own camera.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.files.calibration import load_lens
from testing.calibration_page import (
    PRACTISED,
    WAIT,
    begin,
    calibration_tab,
    figure,
    press,
    result_of,
    simulated_rig,
    wait_for_change,
    wait_for_pictures,
)
from testing.synthetic_boards import BenchSetup

pytestmark = pytest.mark.browser
POSITIONS = 14
InBackground = Callable[[Callable[[threading.Event], None]], threading.Event]
RIG = """
[rig]
name = "desk"
[[camera]]
name = "left"
[viewer]
port = 0
"""


@pytest.fixture
def board_shown(router: str, in_background: InBackground) -> None:
    """A camera before which somebody holds a board, elsewhere after each four pictures."""
    setup = BenchSetup(
        positions=POSITIONS, size_px=(320, 240), focal_px=263.0, distortion=(0.0,) * 5
    )
    bench = setup.bench()
    camera = bench.cameras[0]
    pictures = [
        cv2.imencode(".png", bench.picture(camera, key))[1].tobytes() for key in bench.poses
    ]
    asked = 0

    def answer(query: zenoh.Query) -> None:
        nonlocal asked
        asked += 1
        with query:
            key = topics.FRAME.key("desk", camera="left")
            # No two pictures of a camera are the same.
            shown = pictures[min((asked - 1) // 4, POSITIONS - 1)]
            query.reply(key, shown + asked.to_bytes(4))

    def show(stop: threading.Event) -> None:
        with zenoh.open(client_config([router])) as session:
            session.declare_queryable(topics.FRAME.key("desk", camera="left"), answer)
            stop.wait()

    in_background(show)


@pytest.fixture
def page_url(page_of: Callable[..., str], tmp_path: Path) -> str:
    """A viewer and a calibrator of a rig that was never calibrated; the page's address."""
    (tmp_path / "rig.toml").write_text(RIG, encoding="utf-8")
    return page_of(tmp_path / "rig.toml", "calibrator")


def lens_step(chromium: Any, page_url: str, errors: list[str]) -> Any:
    """A visitor's page that shows the lens step, before it is begun."""
    page = calibration_tab(chromium, page_url, errors)
    for _ in range(2):
        page.get_by_role("button", name="next").click(**WAIT)
    page.get_by_text("Show the printed chessboard to one camera").wait_for(**WAIT)
    return page


def test_a_lens_is_calibrated_from_start_to_saved(
    chromium: Any, page_url: str, board_shown: None, tmp_path: Path
) -> None:
    errors: list[str] = []
    page = lens_step(chromium, page_url, errors)
    page.get_by_text("0 of 3 steps done").wait_for(**WAIT)
    begin(page, 7)
    result_of(page, "error of pictures that were left out")
    assert figure(page, "pictures used") == "7"
    assert not (tmp_path / "calibration" / "left.lens.json").exists()
    press(page, "Save")
    page.get_by_text("1 of 3 steps done").or_(page.get_by_text("Saved:")).first.wait_for(**WAIT)
    made = load_lens(tmp_path / "calibration", "left")
    assert made.matrix[0][0] == pytest.approx(263.0, rel=0.03)
    assert errors == []
    page.close()


@pytest.fixture
def practice_url(page_of: Callable[..., str], router: str, tmp_path: Path) -> str:
    """The page of a simulated rig of one camera, with all that the lens step needs, once the camera
    sends pictures.
    """
    rig = simulated_rig(tmp_path, cameras=1)
    url = page_of(rig, "simulator", "pi_tracker --camera left", "calibrator")
    wait_for_pictures(router, ["left"])
    return url


def test_a_lens_is_practised_and_another_visitor_saves_it(
    chromium: Any, practice_url: str, tmp_path: Path
) -> None:
    lens = tmp_path / "calibration" / "left.lens.json"
    true, before = load_lens(lens.parent, "left"), lens.read_bytes()
    errors: list[str] = []
    page = lens_step(chromium, practice_url, errors)
    page.get_by_text("a board with squares of 25 mm is carried before the camera").wait_for(**WAIT)
    begin(page, PRACTISED)
    page.get_by_text(re.compile(rf"\d/{PRACTISED} positions")).first.wait_for(**WAIT)
    # Who opens the page now is shown the step that is measured, and what comes of it.
    other = calibration_tab(chromium, practice_url, errors)
    page.close()
    result_of(other, "error of pictures that were left out")
    assert figure(other, "pictures used") == str(PRACTISED)
    assert lens.read_bytes() == before
    press(other, "Save")
    wait_for_change(other, lens, before)
    made = load_lens(lens.parent, "left")
    # Of eight positions, which the simulator's camera sees with its noise.
    assert made.matrix[0][0] == pytest.approx(true.matrix[0][0], rel=0.01)
    assert errors == []
    other.close()
