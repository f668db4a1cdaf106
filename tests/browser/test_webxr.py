"""The WebXR page in a real browser, from a real bridge process."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.geometry.transforms import (
    apply,
    rotation_from_quaternion,
    rotation_from_vector,
    transform,
)
from rhot.hand_mesh.skinned_hand import skinned_hand
from rhot.messages import HandPose
from testing.hand_stream import pose_at
from testing.loopback import free_port
from testing.sample_hands import object_pose

pytestmark = pytest.mark.browser
# Chromium without a graphics card shares its cores with everything else.
DEADLINE_S = 60.0
SIZES = {"desktop": (1280, 800), "phone": (390, 844)}
CUP = """
[[object]]
name = "cup"
serial = "LHR-SIM00001"
shape = "cylinder"
size_m = [0.07, 0.1]
[bridges.webxr]
enabled = true
port = {port}
"""


class Bridge:
    """The bridge's process, at one address for all its lives."""

    def __init__(self, router: str, repository: Path, folder: Path) -> None:
        self.port = free_port()
        text = (repository / "config" / "sim.toml").read_text(encoding="utf-8")
        text = text.partition("[[object]]")[0].replace('name = "sim"', 'name = "desk"', 1)
        (folder / "rig.toml").write_text(text + CUP.format(port=self.port), encoding="utf-8")
        own = ["--config", str(folder / "rig.toml"), "--connect", router, "--instance", "webxr"]
        self._command = [sys.executable, "-m", "services.bridges", *own]
        self.url = f"http://127.0.0.1:{self.port}/xr"

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        with subprocess.Popen(self._command, stdout=subprocess.PIPE, text=True) as process:
            for line in process.stdout or ():
                if re.search(r"page at http", line):
                    break
            try:
                yield
            finally:
                process.terminate()
                process.communicate(timeout=DEADLINE_S)


@pytest.fixture
def bridge(router: str, repository: Path, tmp_path: Path) -> Bridge:
    return Bridge(router, repository, tmp_path)


@pytest.fixture
def moving(router: str, in_background) -> HandPose:
    """A hand that is open for a while, then pinches for as long; the first of its poses."""
    poses = [pose_at(0.0, 1, 1), pose_at(0.5, 2, 2)]

    def publish(stop: threading.Event) -> None:
        with zenoh.open(client_config([router])) as session:
            cup = msgspec.json.encode(object_pose("cup"))
            while not stop.wait(0.03):
                pose = poses[int(time.monotonic() / 1.2) % 2]
                session.put(topics.POSE.key("desk", hand="right"), msgspec.json.encode(pose))
                session.put(topics.OBJECT.key("desk", object="cup"), cup)

    in_background(publish)
    return poses[0]


def until(page: Any, script: str, argument: Any = None) -> None:
    page.wait_for_function(script, arg=argument, timeout=1000 * DEADLINE_S, polling=100)


SHOWN = """() => rhot.hands.get('right')?.mesh && rhot.hands.get('right').seen
    && rhot.objects.get('cup').seen"""
# How far the pinching finger's tip is from where it is when the hand is open, in the rig frame.
MOVED = """(open) => {
    const tip = rhot.hands.get('right').bones.get('index-finger-tip').position;
    return Math.hypot(tip.x - open[0], tip.y - open[1], tip.z - open[2]);
}"""


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_the_hand_is_seen_to_move_and_nothing_is_asked_elsewhere(chromium, bridge, moving, size):
    asked: list[str] = []
    errors: list[str] = []
    width, height = SIZES[size]
    page = chromium.new_page(viewport={"width": width, "height": height})
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda said: errors.append(said.text) if said.type == "error" else None)
    with bridge.running():
        page.goto(bridge.url)
        until(page, SHOWN)
        open_tip = list(moving.joint("index_tip").position_m)
        until(page, f"(open) => ({MOVED})(open) < 1e-6", open_tip)
        still = page.screenshot(timeout=1000 * DEADLINE_S)
        until(page, f"(open) => ({MOVED})(open) > 0.02", open_tip)
        # What is drawn is on the screen some pictures later.
        end_s = time.monotonic() + DEADLINE_S
        while page.screenshot(timeout=1000 * DEADLINE_S) == still:
            assert time.monotonic() < end_s, "no pixel has changed"
        # The panel leaves the hand alone: it is drawn below or beside it.
        over = page.evaluate(
            """() => {
                const wrist = rhot.hands.get('right').bones.get('wrist').getWorldPosition(
                    rhot.view.camera.position.clone()).project(rhot.view.camera);
                const box = document.getElementById('panel').getBoundingClientRect();
                const x = (wrist.x + 1) / 2 * innerWidth, y = (1 - wrist.y) / 2 * innerHeight;
                return x < box.right && y < box.bottom;
            }"""
        )
        assert not over
        for words in ("Right hand: seen", "cup: seen", "No headset here"):
            until(
                page, "(words) => document.getElementById('panel').innerText.includes(words)", words
            )
    # Its restart is survived: the page says so meanwhile, and goes on by itself.
    until(page, "() => document.getElementById('state').textContent.includes('Trying again')")
    with bridge.running():
        until(page, "() => document.getElementById('state').textContent.startsWith('Live')")
        until(page, SHOWN)
    own = re.compile(rf"(http|ws)://127\.0\.0\.1:{bridge.port}/|blob:|data:")
    assert all(own.match(url) for url in asked)
    # What failed while the bridge was away is what a browser says of every lost connection.
    assert all("WebSocket" in error or "ERR_CONNECTION" in error for error in errors), errors
    page.close()


def test_where_nothing_comes_it_is_said_what_is_waited_for(chromium, bridge):
    page = chromium.new_page(viewport={"width": 390, "height": 844})
    with bridge.running():
        page.goto(bridge.url)
        until(page, "() => document.getElementById('state').textContent.startsWith('Connected')")
        told = page.inner_text("#panel")
        for words in ("Right hand: waiting", "cup: waiting", "Does the rig run"):
            assert words in told
        assert page.is_disabled("#look")
        states = page.evaluate(
            """(poses) => poses.map((pose) => {
                const cup = rhot.objects.get('cup');
                cup.show(pose, null);
                return cup.state;
            })""",
            [
                msgspec.to_builtins(object_pose("cup", registered=registered, tracking=tracking))
                for registered, tracking in ((False, "ok"), (True, "out_of_range"), (True, "lost"))
            ],
        )
        assert states == [
            "its place in the rig is not calibrated",
            "out of the lighthouses' view",
            "lost",
        ]
    page.close()


def test_the_skin_is_where_ours_is(chromium, bridge, moving):
    """Vertices as three.js draws them, against the skin that exports are made with."""
    page = chromium.new_page()
    with bridge.running():
        page.goto(bridge.url)
        until(page, SHOWN)
        drawn = np.array(
            page.evaluate(
                """(pose) => {
                    const hand = rhot.hands.get('right');
                    hand.show(pose);
                    rhot.view.rig.updateMatrixWorld(true);
                    const { mesh } = hand, at = rhot.view.camera.position.clone();
                    const back = rhot.view.rig.matrixWorld.clone().invert();
                    return Array.from({ length: mesh.geometry.attributes.position.count }, (_, k) =>
                        mesh.getVertexPosition(k, at).applyMatrix4(mesh.matrixWorld)
                            .applyMatrix4(back).toArray());
                }""",
                msgspec.to_builtins(moving),
            )
        )
    skin = skinned_hand("right")
    rotations = np.array([rotation_from_quaternion(q) for q in moving.orientations_wxyz])
    fitted = skin.fit(moving.positions_m, rotations)
    bones = np.tile(np.eye(4), (25, 1, 1))
    bones[:, :3, :3] = fitted.size * fitted.frames(rotations)
    bones[:, :3, 3] = moving.positions_m[1:]
    moves = (bones @ skin.inverse_bind)[skin.joints]  # (n, 4, 4, 4)
    homogeneous = np.hstack([skin.vertices_m, np.ones((len(skin.vertices_m), 1))])
    expected = np.einsum("nb,nbij,nj->ni", skin.weights, moves, homogeneous)[:, :3]
    # Weights and matrices are float32 in the browser.
    np.testing.assert_allclose(drawn, expected, atol=2e-5)
    page.close()


def kabsch(rig: np.ndarray, room: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and translation with room = R rig + t, least squares, by the SVD (Kabsch 1976)."""
    a, b = rig.mean(axis=0), room.mean(axis=0)
    u, _, vt = np.linalg.svd((rig - a).T @ (room - b))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))])
    rotation = vt.T @ sign @ u.T
    return rotation, b - rotation @ a


def test_the_alignments_maths_agree_with_numpys(chromium, bridge):
    page = chromium.new_page()
    random = np.random.default_rng(3)
    fit = "async ([a, b]) => (await import('./xr/align.js')).align(a, b)"
    with bridge.running():
        page.goto(bridge.url)
        turns = [np.zeros(3), np.array([np.pi, 0.0, 0.0]), *random.normal(size=(20, 3)) * 2.0]
        for turn in turns:
            rig = 0.25 * np.eye(3) + random.uniform(-0.05, 0.05, (3, 3))
            room = rig @ rotation_from_vector(turn).T + random.uniform(-1.0, 1.0, 3)
            room += random.normal(scale=0.004, size=room.shape)
            found = page.evaluate(fit, [rig.tolist(), room.tolist()])
            rotation, translation = kabsch(rig, room)
            np.testing.assert_allclose(found["rotation"], rotation, atol=1e-9)
            np.testing.assert_allclose(found["translation"], translation, atol=1e-9)
            left = np.linalg.norm(rig @ rotation.T + translation - room, axis=1)
            np.testing.assert_allclose(found["residuals_m"], left, atol=1e-9)
            assert found["rms_m"] == pytest.approx(np.sqrt(np.mean(left**2)))
        for line in ([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]], [[0, 0, 0]] * 3):
            message = page.evaluate(
                "async (a) => { try { (await import('./xr/align.js')).align(a, a); }"
                " catch (error) { return error.message; } }",
                line,
            )
            assert "touch a triangle" in message
    page.close()


def test_a_headset_shows_the_hand_and_is_aligned_by_three_touches(chromium, bridge, moving):
    """With a fake of WebXR (fake_webxr.js): there is no headset on the machines that test."""
    page = chromium.new_page(viewport={"width": 1000, "height": 700})
    page.add_init_script(path=str(Path(__file__).with_name("fake_webxr.js")))
    T_room_from_rig = transform(rotation_from_vector(np.array([0.3, 2.0, -0.4])), (0.4, 1.1, -0.7))
    known = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0]])
    touched = apply(T_room_from_rig, known)
    with bridge.running():
        page.goto(bridge.url)
        until(page, SHOWN)
        page.click("#aligning summary")
        page.check("input[value=known]")
        page.check("#align")
        page.click("#vr")
        until(page, "() => window.fakeSession?.frames > 3")
        assert page.evaluate("() => fakeSession.mode") == "immersive-vr"
        assert "touch 1 of 3" in page.inner_text("#alignment")
        for point in touched.tolist():
            page.evaluate("(point) => fakeSession.press('select', point)", point)
        assert "aligned to 0 mm" in page.inner_text("#alignment")
        found = np.array(page.evaluate("() => rhot.view.rig.matrix.clone().transpose().toArray()"))
        np.testing.assert_allclose(found.reshape(4, 4), T_room_from_rig, atol=1e-9)
        # The tracked finger itself, held at three places: points that the rig measures.
        page.check("input[value=finger]")
        page.evaluate("() => fakeSession.press('squeeze')")
        tip = np.array(moving.joint("index_tip").position_m)
        for shift in ([0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0]):
            page.evaluate("(at) => { rhot.alignment.fingerTip = () => at; }", list(tip + shift))
            place = apply(T_room_from_rig, tip + shift)
            page.evaluate("(point) => fakeSession.press('select', point)", place.tolist())
        assert "aligned to 0 mm" in page.inner_text("#alignment")
        page.evaluate("() => fakeSession.end()")
        until(page, "() => !rhot.view.renderer.xr.isPresenting")
    page.close()
