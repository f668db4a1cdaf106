"""What a browser is sent of the scene: whole pictures, what has changed, what is switched on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
import viser

from rhot.files.config import RigConfig
from rhot.files.rig_tables import Viewer
from rhot.geometry.transforms import quaternion_from_rotation, rotation_from_vector
from rhot.hand import JOINTS, default_hand, forward
from rhot.messages import FingerAngles, HandPose
from services.viewer.live.model import ViewModel
from services.viewer.live.views import View
from services.viewer.scene.layers import DEFAULT
from services.viewer.scene.scene import LiveScene
from services.viewer.scene.skin_shape import fit_skin
from services.viewer.server import open_server

STAMP_NS = 1_700_000_000_000_000_000


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    with open_server(Viewer(port=0)) as server:
        yield server


@pytest.fixture
def scene(server: viser.ViserServer, config: RigConfig) -> LiveScene:
    return LiveScene(server, config, {}, {("right", "index_tip"): (0, 0, 255)}, {})


@pytest.fixture
def posed(make_pose: Callable[..., HandPose]) -> Callable[..., HandPose]:
    """A hand pose with random angles, as a solver would send it."""
    rng = np.random.default_rng(11)

    def make(hand: Any = "right", **fields: Any) -> HandPose:
        model = default_hand(hand)
        angles = rng.uniform(*np.moveaxis(model.limits_rad, 2, 0))
        positions, rotations = forward(
            model, rotation_from_vector(rng.normal(size=3)), rng.uniform(-0.3, 0.3, 3), angles
        )
        flat = make_pose(hand=hand)
        joints = [
            msgspec.structs.replace(
                joint,
                position_m=tuple(p.tolist()),
                orientation_wxyz=tuple(quaternion_from_rotation(r).tolist()),
            )
            for joint, p, r in zip(flat.joints, positions, rotations, strict=True)
        ]
        fingers = [
            msgspec.structs.replace(
                finger, angles_rad=FingerAngles(abduction=a, mcp=b, pip=c, dip=d, cmc=b)
            )
            for finger, (a, b, c, d) in zip(flat.fingers, angles, strict=True)
        ]
        return msgspec.structs.replace(flat, joints=joints, fingers=fingers, **fields)

    return make


def seen(*poses: HandPose) -> View:
    model = ViewModel()
    for pose in poses:
        model.pose(pose, 0.0, STAMP_NS)
    return model.view(0.0)


def updates(window: list[dict[str, Any]]) -> dict[tuple[str, str], Any]:
    """What changed, by scene node and property."""
    return {
        (message["name"], name): value
        for message in window
        if message["type"] == "SceneNodeUpdateMessage"
        for name, value in message["updates"].items()
    }


def until_joints(browser: Any, pose: HandPose) -> dict[tuple[str, str], Any]:
    """The picture that has the joints of a pose."""
    while True:
        changed = updates(browser.window())
        joints = changed.get((f"/hands/{pose.hand}/joints", "batched_positions"))
        if joints is not None and np.allclose(joints.reshape(26, 3), pose.positions_m, atol=1e-6):
            return changed


def test_skin_joints_and_bones_of_a_picture_are_of_one_message(
    server: viser.ViserServer, scene: LiveScene, browse: Callable, posed: Callable[..., HandPose]
) -> None:
    """Also when views come much faster than pictures are sent: two hands, two hundred poses."""
    pairs = [(posed("right"), posed("left")) for _ in range(200)]
    scene.show(seen(*pairs[0]))
    browser = browse(server.get_port())
    browser.wait_for("MeshMessage", name="/skin/left")
    shapes = {p.hand: fit_skin(p.hand, *_joints(p)) for p in pairs[0]}
    for pair in pairs[1:]:
        scene.show(seen(*pair))
    of_row = {pair[0].positions_m[0].astype(np.float32).tobytes(): pair for pair in pairs}
    pictures, last = 0, False
    while not last:
        changed = updates(browser.window())
        joints = changed.get(("/hands/right/joints", "batched_positions"))
        if joints is None:
            continue
        pair = of_row[joints[:3].tobytes()]
        pictures, last = pictures + 1, pair is pairs[-1]
        for pose in pair:
            drawn = changed[f"/hands/{pose.hand}/joints", "batched_positions"].reshape(26, 3)
            np.testing.assert_allclose(drawn, pose.positions_m, atol=1e-6)
            skin = changed[f"/skin/{pose.hand}", "vertices"].reshape(-1, 3)
            expected = shapes[pose.hand].vertices(*_joints(pose))
            np.testing.assert_allclose(skin, expected, atol=1e-6)
            middles = changed[f"/hands/{pose.hand}/bones", "batched_positions"].reshape(-1, 3)
            wrist, thumb = (
                pose.positions_m[JOINTS.index(n)] for n in ("wrist", "thumb_metacarpal")
            )
            np.testing.assert_allclose(middles[0], 0.5 * (wrist + thumb), atol=1e-6)
    assert pictures >= 1


def _joints(pose: HandPose) -> tuple[np.ndarray, np.ndarray]:
    view = seen(pose).hands[pose.hand]
    return view.positions_m, view.rotations


def test_what_has_not_changed_is_not_sent(
    server: viser.ViserServer, scene: LiveScene, browse: Callable, posed: Callable[..., HandPose]
) -> None:
    still, moving = posed("right"), [posed("left") for _ in range(3)]
    model = ViewModel()
    model.pose(still, 0.0, STAMP_NS)
    model.pose(moving[0], 0.0, STAMP_NS)
    scene.show(model.view(0.0))
    browser = browse(server.get_port())
    browser.wait_for("MeshMessage", name="/skin/left")
    for pose in moving[1:]:
        model.pose(pose, 0.0, STAMP_NS)
        scene.show(model.view(0.0))
        changed = until_joints(browser, pose)
        assert {name for name, _ in changed} == {
            "/hands/left/joints", "/hands/left/bones", "/skin/left",
        }  # fmt: skip


def test_a_layer_that_nobody_watches_is_not_sent_and_one_that_is_tells_of_limits(
    server: viser.ViserServer, scene: LiveScene, browse: Callable, posed: Callable[..., HandPose]
) -> None:
    poses = [posed() for _ in range(4)]
    scene.show(seen(poses[0]))
    browser = browse(server.get_port())
    browser.wait_for("BatchedMeshesMessage", name="/hands/right/joints")
    scene.show(seen(poses[1]), {"limits"})
    changed = until_joints(browser, poses[1])
    assert ("/limits/right", "points") in changed
    assert ("/skin/right", "vertices") not in changed
    scene.show(seen(poses[2]), DEFAULT)
    changed = until_joints(browser, poses[2])
    assert ("/limits/right", "points") not in changed
    assert ("/skin/right", "vertices") in changed


def test_what_goes_wrong_in_a_drawing_is_told_to_who_shows(
    server: viser.ViserServer, scene: LiveScene, browse: Callable, posed: Callable[..., HandPose]
) -> None:
    scene.show(seen(posed()))
    browser = browse(server.get_port())
    browser.wait_for("BatchedMeshesMessage", name="/hands/right/joints")
    # Somebody removes a node that is drawn: viser says so.
    server.scene.remove_by_name("/hands")
    scene.show(seen(posed()))
    with pytest.raises(RuntimeError, match="removed"):
        while True:
            scene.show(seen(posed()))
