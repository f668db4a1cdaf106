"""Hands' motion, opened with readers that we did not write: bvhio, trc-data-reader, pygltflib."""

from __future__ import annotations

import io

import bvhio
import numpy as np
import pandas as pd
import pygltflib
import pytest
import trc
from scipy.spatial.transform import Rotation

from rhot.errors import CaptureError, ConfigError
from rhot.files.capture import read_lines
from rhot.geometry.up_axes import UPS
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINT_INDEX, TIPS
from rhot.hand_mesh.skinned_hand import PARENTS, SKIN_JOINTS, webxr_name
from rhot.messages import HandPose
from services.cli.export.export import export
from services.cli.export.motion.clip import clips
from services.cli.export.motion.run import export_motion
from testing.hand_stream import pose_at

TENTH_MM = 1e-4
RATE_HZ = 50.0


@pytest.fixture(scope="module")
def poses() -> list[HandPose]:
    """A hand that pinches, at an even rate, turning and moving as a whole."""
    return [pose_at(n / RATE_HZ, 10**18 + round(n * 1e9 / RATE_HZ), n) for n in range(60)]


@pytest.fixture(scope="module")
def written(poses, tmp_path_factory):
    """All four files of those poses, in a result folder of `rhot track`."""
    import msgspec

    folder = tmp_path_factory.mktemp("result")
    lines = b"\n".join(msgspec.json.encode(pose) for pose in poses)
    (folder / "poses.jsonl").write_bytes(lines + b"\n")
    (folder / "summary.json").write_text("{}")
    export_motion(folder, folder, ["bvh", "trc", "mot", "gltf"], "-y")
    return folder


def _up(positions_m: np.ndarray) -> np.ndarray:
    """From the camera's frame to one with y up."""
    return positions_m * [1.0, -1.0, -1.0]


def test_bvh_has_our_joints_to_a_tenth_of_a_millimetre(written, poses):
    root = bvhio.readAsHierarchy(written / "right_hand.bvh")
    joints = {joint.Name.removeprefix("right_"): joint for joint, _, _ in root.layout()}
    assert set(joints) >= {name for name in SKIN_JOINTS if name not in TIPS}
    for frame in range(0, len(poses), 7):
        root.loadPose(frame)
        for name in SKIN_JOINTS:
            if name in TIPS:
                continue
            found = np.array(joints[name].PositionWorld)
            expected = _up(poses[frame].positions_m)[JOINT_INDEX[name]]
            assert np.linalg.norm(found - expected) < TENTH_MM, name


def test_bvh_has_the_tips_as_end_sites_and_the_rate(written, poses):
    read = bvhio.readAsBvh(written / "right_hand.bvh")
    assert read.FrameCount == len(poses)
    assert read.FrameTime == pytest.approx(1.0 / RATE_HZ)
    layout = [joint for joint, _, _ in read.Root.layout()]
    ends = {joint.Name: joint.EndSite for joint in layout if not joint.Children}
    assert set(ends) == {f"right_{digit}_distal" for digit in DIGITS}
    length_m = np.linalg.norm(np.array(ends["right_index_distal"]))
    bone = poses[0].positions_m[JOINT_INDEX["index_tip"]]
    bone = bone - poses[0].positions_m[JOINT_INDEX["index_distal"]]
    assert length_m == pytest.approx(np.linalg.norm(bone), abs=TENTH_MM)


def test_trc_has_all_joints(written, poses):
    data = trc.TRCData()
    data.load(str(written / "right_hand.trc"))
    assert data["Markers"] == list(SKIN_JOINTS)
    assert (data["Units"], data["NumFrames"]) == ("mm", len(poses))
    for frame in range(0, len(poses), 7):
        seconds, row = data[frame + 1]
        assert seconds == pytest.approx(frame / RATE_HZ)
        expected = 1e3 * _up(poses[frame].positions_m)[1:]
        assert np.abs(np.array(row) - expected).max() < 0.1


def test_mot_has_all_angles(written, poses):
    text = (written / "right_hand.mot").read_text()
    head, _, body = text.partition("endheader\n")
    assert "inDegrees=yes" in head
    table = pd.read_csv(io.StringIO(body), sep="\t")
    assert f"nRows={len(table)}" in head
    assert f"nColumns={len(table.columns)}" in head
    assert len(table) == len(poses)
    for row, (digit, names) in enumerate(zip(DIGITS, DIGIT_ANGLES, strict=True)):
        for column, name in enumerate(names):
            expected = np.degrees([pose.angles_rad[row, column] for pose in poses])
            assert np.allclose(table[f"{digit}_{name}"], expected, atol=1e-3)
    assert np.allclose(table["wrist_ty"], [-pose.wrist.position_m[1] for pose in poses], atol=1e-5)


def _world(gltf, frame):
    """Transforms (4, 4) of every node by name at a frame, by the rules of glTF 2.0, 3.11."""
    animation = gltf.animations[0]
    moved: dict[int, dict[str, np.ndarray]] = {}
    for channel in animation.channels:
        sampler = animation.samplers[channel.sampler]
        moved.setdefault(channel.target.node, {})[channel.target.path] = _array(
            gltf, sampler.output
        )[frame]
    found = {}

    def visit(n, parent):
        node = gltf.nodes[n]
        t = moved.get(n, {}).get("translation", node.translation or [0.0] * 3)
        q = moved.get(n, {}).get("rotation", node.rotation or [0.0, 0.0, 0.0, 1.0])
        local = np.eye(4)
        local[:3, :3] = Rotation.from_quat(q).as_matrix() * np.array(node.scale or [1.0] * 3)
        local[:3, 3] = t
        found[node.name] = parent @ local
        for child in node.children or []:
            visit(child, found[node.name])

    for n in gltf.scenes[gltf.scene].nodes:
        visit(n, np.eye(4))
    return found


def _array(gltf, accessor):
    about = gltf.accessors[accessor]
    view = gltf.bufferViews[about.bufferView]
    size = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[about.type]
    blob = gltf.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    return np.frombuffer(blob, "<f4").reshape(about.count, size)


def test_gltf_has_our_joints_and_a_skin_that_moves(written, poses):
    gltf = pygltflib.GLTF2().load(str(written / "right_hand.glb"))
    times = _array(gltf, gltf.animations[0].samplers[0].input)
    assert np.allclose(times[:, 0], np.arange(len(poses)) / RATE_HZ, atol=1e-6)
    assert len(gltf.skins[0].joints) == len(SKIN_JOINTS)
    for frame in range(0, len(poses), 7):
        world = _world(gltf, frame)
        expected = _up(poses[frame].positions_m)
        for name in SKIN_JOINTS:
            apart = world[webxr_name(name)][:3, 3] - expected[JOINT_INDEX[name]]
            assert np.linalg.norm(apart) < TENTH_MM, name


def test_the_axis_that_is_up_becomes_y(poses):
    for name, turn in UPS.items():
        assert np.linalg.det(turn) == pytest.approx(1.0)
        axis = np.zeros(3)
        axis["xyz".index(name[-1])] = -1.0 if name[0] == "-" else 1.0
        assert np.allclose(turn @ axis, [0.0, 1.0, 0.0]), name


def test_uneven_poses_come_at_an_even_rate_with_bones_of_one_length(poses):
    late = [pose for n, pose in enumerate(poses) if n % 5 != 3]
    (clip,) = clips(late, "y", late[0].stamp_ns)
    assert clip.rate_hz == RATE_HZ
    assert len(clip.wrist_m) == len(poses)
    positions = clip.positions_m()
    for j, name in enumerate(SKIN_JOINTS):
        if PARENTS[name] is not None:
            bone = positions[:, j] - positions[:, SKIN_JOINTS.index(PARENTS[name])]
            assert np.ptp(np.linalg.norm(bone, axis=1)) < 1e-9
    between = np.abs(positions - [pose.positions_m[1:] for pose in poses])
    assert between.max() < 1e-3


def test_a_break_is_bridged_and_counted(poses):
    (clip,) = clips([*poses[:10], *poses[40:]], "y", poses[0].stamp_ns)
    assert clip.gaps == 1
    assert len(clip.wrist_m) == len(poses)


def test_the_command_says_what_it_wrote(result, tmp_path, capsys):
    export(result, tmp_path, bvh=True, gltf=True)
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in lines] == [
        str(tmp_path / "right_hand.bvh"),
        str(tmp_path / "right_hand.glb"),
    ]
    assert all(" Hz" in line for line in lines)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["right_hand.bvh", "right_hand.glb"]
    first = next(iter(read_lines(result / "poses.jsonl", HandPose)))
    root = bvhio.readAsHierarchy(tmp_path / "right_hand.bvh").loadPose(0)
    assert np.allclose(
        np.array(root.PositionWorld), _up(np.array(first.wrist.position_m)), atol=1e-4
    )


def test_another_way_up_is_refused(result):
    with pytest.raises(ConfigError, match="--up w: valid: y, -y, z"):
        export(result, bvh=True, up="w")


def test_a_single_pose_is_no_motion(poses):
    with pytest.raises(CaptureError, match="two poses at least"):
        clips(poses[:1], "y", 0)
