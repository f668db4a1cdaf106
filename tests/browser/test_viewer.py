"""The live view as a person sees it: a real viewer process, a real browser, pixels."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.files.config import RigConfig, load_rig
from rhot.geometry.transforms import quaternion_from_rotation, rotation_x, rotation_z
from rhot.hand import (
    BASIC_LANDMARKS,
    DIGITS,
    JOINT_INDEX,
    JOINTS,
    default_hand,
    forward,
    joint_radii_m,
)
from rhot.messages import FingerAngles, FingerPose, HandJoint, HandPose, WristPose
from rhot.messages.objects import Contact, Grasp, HandPart, ObjectContacts, ObjectPose
from testing.sample_health import beat, fault

pytestmark = pytest.mark.browser
# Chromium without a graphics card shares its cores with the viewer and everything else.
DEADLINE_S = 90.0
OBJECT_AT = (0.17, 0.05, 0.55)
CUP = """
[[object]]
name = "cup"
serial = "LHR-SIM00001"
shape = "cylinder"
size_m = [0.07, 0.1]

[viewer]
port = 0
"""
HELD: tuple[HandPart, ...] = ("thumb", "index", "middle")
HELD_TEXT = "right hand holds cup (thumb, index, middle)"
InBackground = Callable[[Callable[[threading.Event], None]], threading.Event]


@pytest.fixture
def rig(repository: Path) -> RigConfig:
    return load_rig(repository / "config" / "sim.toml")


@pytest.fixture
def viewer(page_of: Callable[..., str], repository: Path, tmp_path: Path) -> str:
    """The page of the simulated rig with a cup; its address."""
    text = (repository / "config" / "sim.toml").read_text(encoding="utf-8")
    (tmp_path / "rig.toml").write_text(text.partition("[[object]]")[0] + CUP, encoding="utf-8")
    (tmp_path / "calibration").symlink_to(repository / "config" / "calibration")
    return page_of(tmp_path / "rig.toml")


def hand_pose(seq: int) -> HandPose:
    """An upright right hand half a metre away, palm to the cameras, bending its fingers."""
    model = default_hand("right")
    bend = 0.4 + 0.4 * np.sin(0.1 * seq)
    angles = np.zeros((5, 4))
    angles[1:] = [0.0, 0.7 * bend, bend, 0.66 * bend]
    positions, rotations = forward(
        model, rotation_x(-np.pi / 2) @ rotation_z(np.pi), np.array([0.04, 0.08, 0.48]), angles
    )
    joints = [
        HandJoint(
            name=name,
            position_m=tuple(p.tolist()),
            orientation_wxyz=tuple(quaternion_from_rotation(R).tolist()),
            radius_m=float(radius),
            source="measured" if name in BASIC_LANDMARKS else "solved",
        )
        for name, p, R, radius in zip(
            JOINTS, positions, rotations, joint_radii_m(model), strict=True
        )
    ]
    fingers = [
        FingerPose(
            name=digit,  # type: ignore[arg-type]
            angles_rad=FingerAngles(
                abduction=float(a[0]), mcp=float(a[1]), pip=float(a[2]), dip=float(a[3])
            ),
            residual_m=0.0,
            iterations=1,
            status="solved",
        )
        for digit, a in zip(DIGITS, angles, strict=True)
    ]
    wrist = WristPose(position_m=joints[1].position_m, orientation_wxyz=joints[1].orientation_wxyz)
    return HandPose(
        hand="right",
        seq=seq,
        stamp_ns=time.time_ns() - 30_000_000,
        method="dls",
        wrist=wrist,
        joints=joints,
        fingers=fingers,
    )


def cup_pose(seq: int) -> ObjectPose:
    return ObjectPose(
        object="cup",
        serial="LHR-SIM00001",
        seq=seq,
        stamp_ns=time.time_ns(),
        position_m=OBJECT_AT,
        orientation_wxyz=(1.0, 0.0, 0.0, 0.0),
        velocity_m_s=(0.0, 0.0, 0.0),
        angular_velocity_rad_s=(0.0, 0.0, 0.0),
        tracking="ok",
        registered=True,
    )


def cup_contacts(seq: int) -> ObjectContacts:
    """Three fingers of the moving hand on the cup, at their own tips."""
    hand = hand_pose(seq)
    contacts = [
        Contact(
            hand="right",
            part=part,
            distance_m=0.0,
            sigma_m=0.001,
            point_m=hand.joints[JOINT_INDEX[f"{part}_tip"]].position_m,
            touching=True,
            since_ns=hand.stamp_ns,
        )
        for part in HELD
    ]
    grasp = Grasp(hand="right", parts=list(HELD), since_ns=hand.stamp_ns)
    return ObjectContacts(
        object="cup", seq=seq, stamp_ns=hand.stamp_ns, contacts=contacts, grasps=[grasp]
    )


@pytest.fixture
def moving_hand(router: str, rig: RigConfig, in_background: InBackground) -> threading.Event:
    """Publishes a hand and a cup at 30 Hz until the event is set."""
    hand_key = topics.POSE.key(rig.rig.name, hand="right")
    cup_key = topics.OBJECT.key(rig.rig.name, object="cup")

    def publish(stop: threading.Event) -> None:
        with zenoh.open(client_config([router])) as session:
            for seq in itertools.count():
                session.put(hand_key, msgspec.json.encode(hand_pose(seq)))
                session.put(cup_key, msgspec.json.encode(cup_pose(seq)))
                if stop.wait(1 / 30):
                    return

    return in_background(publish)


@pytest.fixture
def holding(router: str, rig: RigConfig, in_background: InBackground) -> threading.Event:
    """Publishes that the hand holds the cup until the event is set."""
    key = topics.CONTACTS.key(rig.rig.name, object="cup")

    def publish(stop: threading.Event) -> None:
        with zenoh.open(client_config([router])) as session:
            for seq in itertools.count():
                session.put(key, msgspec.json.encode(cup_contacts(seq)))
                if stop.wait(1 / 30):
                    return

    return in_background(publish)


def picture(page: Any) -> np.ndarray:
    """The scene as (h, w, 3): the page without the panel on its right, the notice wiped out."""
    image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    pixels = np.array(
        image.open(BytesIO(page.screenshot(timeout=DEADLINE_S * 1e3))).convert("RGB")
    ).astype(int)
    height, width, _ = pixels.shape
    pixels[int(0.6 * height) :, : int(0.27 * width)] = 255
    return pixels[:, : int(0.65 * width)]


def blue_and_green(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Masks of what is bluish (solved joints and bones) and greenish (measured joints, and the
    cup).
    """
    red, green, blue = np.moveaxis(pixels, 2, 0)
    return (blue - red > 30) & (blue - green > 15), (green - red > 25) & (green - blue > -5)


def test_a_moving_hand_is_seen_in_the_middle_and_its_angles_are_told(
    chromium: Any, viewer: str, moving_hand: threading.Event
) -> None:
    page = chromium.new_page(viewport={"width": 1200, "height": 750})
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(viewer)
    page.get_by_text("right hand: tracked").wait_for(timeout=DEADLINE_S * 1e3)
    page.get_by_text("object cup: tracked").wait_for(timeout=DEADLINE_S * 1e3)
    deadline = time.monotonic() + DEADLINE_S
    while (seen := blue_and_green(picture(page)))[0].sum() < 1500 and time.monotonic() < deadline:
        page.wait_for_timeout(200)
    blue, green = seen
    assert blue.sum() >= 1500, "no hand is drawn"
    assert green.sum() >= 200, "neither measured joints nor the cup are drawn"
    rows, columns = np.nonzero(blue)
    assert 0.1 < rows.mean() / blue.shape[0] < 0.65
    assert 0.25 < columns.mean() / blue.shape[1] < 0.75
    before = picture(page)
    while np.abs(picture(page) - before).max() < 60 and time.monotonic() < deadline:
        page.wait_for_timeout(100)
    assert np.abs(picture(page) - before).max() >= 60, "nothing moves"
    assert page.locator("table tr", has_text="index").inner_text().count("°") == 4
    moving_hand.set()
    page.get_by_text("right hand: waiting for").wait_for(timeout=DEADLINE_S * 1e3)
    while blue_and_green(picture(page))[0].sum() > 300 and time.monotonic() < deadline:
        page.wait_for_timeout(200)
    assert blue_and_green(picture(page))[0].sum() <= 300, "a hand is drawn that is not there"
    assert errors == []
    page.close()


def test_touching_tips_are_lit_and_told_for_as_long_as_they_touch_also_on_a_phone(
    chromium: Any, viewer: str, moving_hand: threading.Event, holding: threading.Event
) -> None:
    page = chromium.new_page(viewport={"width": 1280, "height": 800})
    page.goto(viewer)
    page.get_by_text(HELD_TEXT).wait_for(timeout=DEADLINE_S * 1e3)
    deadline = time.monotonic() + DEADLINE_S
    while lit(page) < 40 and time.monotonic() < deadline:
        page.wait_for_timeout(200)
    assert lit(page) >= 40, "no tip is lit"
    phone = chromium.new_page(viewport={"width": 390, "height": 844})
    phone.goto(viewer)
    # The sheet of controls is closed at first: the screen is the hand's.
    phone.get_by_text("rhot: ").first.click(timeout=DEADLINE_S * 1e3)
    phone.get_by_text(HELD_TEXT).wait_for(timeout=DEADLINE_S * 1e3)
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390
    holding.set()
    for one in (page, phone):
        one.get_by_text(HELD_TEXT).wait_for(state="hidden", timeout=DEADLINE_S * 1e3)
    deadline = time.monotonic() + DEADLINE_S
    while lit(page) >= 40 and time.monotonic() < deadline:
        page.wait_for_timeout(200)
    assert lit(page) < 40, "tips are lit that touch nothing"
    moving_hand.set()
    phone.get_by_text("object cup: nothing has come for").wait_for(timeout=DEADLINE_S * 1e3)
    page.close()
    phone.close()


def lit(page: Any) -> int:
    """How many pixels of the scene, without panel and notice, are as yellow as halos."""
    pixels = picture(page)
    red, green, blue = np.moveaxis(pixels, 2, 0)
    yellow = (red > 150) & (red - blue > 70) & (green - blue > 50) & (np.abs(red - green) < 60)
    return int(yellow.sum())


def test_a_fault_stands_at_the_top_with_what_to_do_until_it_is_over(
    chromium: Any, viewer: str, router: str, rig: RigConfig, in_background: InBackground
) -> None:
    key = topics.HEALTH.key(rig.rig.name, service="fusion", instance="main")
    over = threading.Event()
    moved = fault("camera_moved", "<b>left</b> has moved", "left")

    def publish(stop: threading.Event) -> None:
        with zenoh.open(client_config([router])) as session:
            while not stop.wait(0.3):
                health = beat("fusion", faults=[] if over.is_set() else [moved])
                session.put(key, msgspec.json.encode(health))

    in_background(publish)
    page = chromium.new_page(viewport={"width": 1200, "height": 750})
    page.goto(viewer)
    told = page.get_by_text("<b>left</b> has moved (says fusion)")
    told.wait_for(timeout=DEADLINE_S * 1e3)
    panel = page.inner_text("body")
    assert panel.index("has moved") < panel.index("right hand: waiting for")
    assert "run rhot calibrate stereo" in panel
    # The trackers of this rig do not run, which is nobody's own word.
    page.get_by_text("programs of this rig do not run").wait_for(timeout=DEADLINE_S * 1e3)
    over.set()
    told.wait_for(state="hidden", timeout=DEADLINE_S * 1e3)
    page.close()
