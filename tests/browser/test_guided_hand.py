"""The hand step in a real browser, both ways, from Start to Save: real viewer and calibrator
processes, and points of a hand whose bones are known.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.files.calibration import load_hand
from rhot.hand import BASIC_LANDMARKS, default_hand
from rhot.hand_exercises import CYCLE_S
from services.simulator.hands.calibration_exercises import guided
from services.simulator.hands.gestures import MOTIONS, Motion
from testing.calibration_page import PHONE, WAIT, calibration_tab, choose, press, wait_for_change
from testing.synthetic_hands import hand_message, noisy_points, wrist_rotation

pytestmark = pytest.mark.browser
SIZE, RATE_HZ = 0.85, 15.0
# Of its size; what is left comes from a millimetre of noise.
NEAR = 0.04
MARKERS = "\n".join(f'{name} = "color{k}"' for k, name in enumerate(BASIC_LANDMARKS))
RIG = f"""
[rig]
name = "desk"
[[camera]]
name = "left"
[[camera]]
name = "right"
[hand.right.markers]
{MARKERS}
[viewer]
port = 0
"""
InBackground = Callable[[Callable[[threading.Event], None]], threading.Event]


def moved(motion: Motion, seconds: float) -> Iterator[bytes]:
    """A hand's points as fusion sends them."""
    model, random = default_hand("right", SIZE), np.random.default_rng(3)
    for frame in range(round(RATE_HZ * seconds)):
        gesture = motion(frame / RATE_HZ)
        R = wrist_rotation(gesture, np.zeros(3))
        position_m = np.array([0.0, 0.0, 0.5]) + gesture.shift_m
        points = noisy_points(model, R, position_m, gesture.angles_rad, random)
        yield msgspec.json.encode(hand_message(model, frame, frame / RATE_HZ, points))


@pytest.fixture
def show(router: str, in_background: InBackground) -> Callable[..., threading.Event]:
    """Send points of so many seconds until the event is set, faster than a hand moves: their stamps
    are those of its own pace.
    """

    def send(motion: Motion, seconds: float) -> threading.Event:
        def sending(stop: threading.Event) -> None:
            with zenoh.open(client_config([router])) as session:
                points = session.declare_publisher(topics.POINTS.key("desk", hand="right"))
                for message in moved(motion, seconds):
                    if stop.wait(0.004):
                        return
                    points.put(message)

        return in_background(sending)

    return send


@pytest.fixture
def page_url(page_of: Callable[..., str], tmp_path: Path) -> str:
    (tmp_path / "rig.toml").write_text(RIG, encoding="utf-8")
    return page_of(tmp_path / "rig.toml", "calibrator")


def test_a_hand_is_measured_by_exercises_and_then_while_it_is_used(
    chromium: Any, page_url: str, show: Callable[..., threading.Event], tmp_path: Path
) -> None:
    model, errors = default_hand("right", SIZE), list[str]()
    page = calibration_tab(chromium, page_url, errors)
    choose(page, "step", "Hand")
    page.get_by_text("Follow twelve short exercises").wait_for(**WAIT)
    press(page, "Start")
    page.get_by_text("In 3 seconds: open hand").wait_for(**WAIT)
    # In circles: one whole round of them counts, wherever it begins.
    exercising = show(guided(model, 3), 100.0 * CYCLE_S)
    page.get_by_text("left between hand and paint").wait_for(**WAIT)
    exercising.set()
    # Instead of saving it: the other way.
    press(page, "Back to the start")
    choose(page, "how", "just use the hand")
    page.get_by_text("rhot calibrate hand right --watch").wait_for(**WAIT)
    press(page, "Start")
    page.get_by_text("in view of two cameras").first.wait_for(**WAIT)
    press(page, "Save")
    page.get_by_text("Not saved, since it is not good yet").wait_for(**WAIT)
    file = tmp_path / "calibration" / "hand.right.json"
    assert not file.exists()
    # A second visitor, on a phone, joins what goes on, and is told nothing of the refusal.
    other = calibration_tab(chromium, page_url, errors, PHONE)
    other.get_by_role("button", name="Stop").wait_for(**WAIT)
    assert other.get_by_text("Not saved").count() == 0
    show(MOTIONS["random"](model, 8), 66.0)
    for visitor in (page, other):
        visitor.get_by_text("Good enough: press Save").wait_for(**WAIT)
    row = other.locator("table tr", has_text="bones of the ring finger").inner_text()
    assert row.split()[-1] == "mm"
    save = other.get_by_role("button", name="Save")
    assert save.bounding_box()["y"] + save.bounding_box()["height"] <= 844.0
    save.click(**WAIT)
    wait_for_change(other, file, b"")
    made = load_hand(file.parent, "right")
    lengths, true = (sum(sum(one.lengths_m) for one in hand.digits) for hand in (made, model))
    assert lengths == pytest.approx(true, rel=NEAR)
    assert errors == []
    page.close()
    other.close()
