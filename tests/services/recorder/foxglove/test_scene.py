"""What goes into a recording for Foxglove: byte for byte what its own encoder makes of it."""

from __future__ import annotations

import itertools
from pathlib import Path

import msgspec
import pytest
from mcap.reader import make_reader

from rhot import topics
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.files.rig_tables import Recorder as RecorderTable
from rhot.messages.objects import ObjectPose
from services.recorder.foxglove import wire
from services.recorder.foxglove.scene import SCENE, TRANSFORMS, FoxgloveScene, schema
from services.recorder.reader import read, summarize
from services.recorder.recorder import attachments
from services.recorder.recover import recover
from testing.recorded_hand import write_hand

STAMP_NS = 1_700_000_001_000_000_002
# Not one zero: an encoder leaves those out, and ours does not.
AT, TURN = (0.1, -0.2, 0.3), (0.5, -0.5, 0.5, 0.5)
RGBA = (0.1, 0.2, 0.3, 0.4)

fox = pytest.importorskip("foxglove.messages", reason="foxglove-sdk is not installed")


def cup(**fields: object) -> ObjectPose:
    values = {
        "object": "cup",
        "serial": "LHR-1",
        "seq": 1,
        "stamp_ns": STAMP_NS,
        "position_m": AT,
        "orientation_wxyz": TURN,
        "velocity_m_s": (0.0, 0.0, 0.0),
        "angular_velocity_rad_s": (0.0, 0.0, 0.0),
        "tracking": "ok",
        "registered": True,
    }
    return ObjectPose(**{**values, **fields})  # type: ignore[arg-type]


def their_pose() -> object:
    return fox.Pose(position=vector(AT), orientation=turn(TURN))


def vector(xyz: tuple[float, ...]) -> object:
    return fox.Vector3(x=xyz[0], y=xyz[1], z=xyz[2])


def turn(wxyz: tuple[float, ...]) -> object:
    return fox.Quaternion(w=wxyz[0], x=wxyz[1], y=wxyz[2], z=wxyz[3])


def stamp() -> object:
    return fox.Timestamp(sec=STAMP_NS // 10**9, nsec=STAMP_NS % 10**9)


def test_the_schemas_are_foxgloves_own() -> None:
    for name in (TRANSFORMS, SCENE):
        published = getattr(fox, name.removeprefix("foxglove.")).get_schema()
        assert (published.name, published.encoding) == (name, "protobuf")
        assert schema(name) == published.data


def test_transforms_are_byte_for_byte_theirs() -> None:
    ours = wire.frame_transform(wire.timestamp(STAMP_NS), "rig", "right_wrist", AT, TURN)
    theirs = fox.FrameTransform(
        timestamp=stamp(),
        parent_frame_id="rig",
        child_frame_id="right_wrist",
        translation=vector(AT),
        rotation=turn(TURN),
    )
    assert ours == fox.FrameTransforms(transforms=[theirs]).encode()


def theirs_and_ours() -> list[tuple[dict[str, object], bytes]]:
    color = fox.Color(r=RGBA[0], g=RGBA[1], b=RGBA[2], a=RGBA[3])
    at, theirs = wire.pose(AT, TURN), their_pose()
    points = [fox.Point3(x=0.1, y=0.2, z=0.3), fox.Point3(x=0.4, y=0.5, z=0.6)]
    line = fox.LinePrimitive(pose=theirs, thickness=0.01, points=points, color=color)
    spheres = [fox.SpherePrimitive(pose=theirs, size=vector((0.2,) * 3), color=color)]
    cubes = [fox.CubePrimitive(pose=theirs, size=vector(AT), color=color)]
    cylinders = [
        fox.CylinderPrimitive(
            pose=theirs, size=vector((0.1, 0.1, 0.2)), bottom_scale=1.0, top_scale=1.0, color=color
        )
    ]
    model = fox.ModelPrimitive(
        pose=theirs, scale=vector((1.0, 1.0, 1.0)), media_type="model/stl", data=b"abc" * 100
    )
    return [
        ({"spheres": spheres}, wire.sphere(at, 0.2, RGBA)),
        ({"cubes": cubes}, wire.cube(at, AT, RGBA)),
        ({"cylinders": cylinders}, wire.cylinder(at, 0.1, 0.2, RGBA)),
        (
            {"lines": [line]},
            wire.line_strip(at, [(0.1, 0.2, 0.3), (0.4, 0.5, 0.6)], 0.01, RGBA),
        ),
        ({"models": [model]}, wire.model(at, b"abc" * 100, "model/stl")),
    ]


def test_scenes_are_byte_for_byte_theirs() -> None:
    for primitives, ours in theirs_and_ours():
        entity = fox.SceneEntity(
            timestamp=stamp(),
            frame_id="rig",
            id="right_hand",
            lifetime=fox.Duration(sec=1, nsec=5),
            frame_locked=True,
            **primitives,
        )
        made = wire.scene_update(
            wire.timestamp(STAMP_NS), "rig", "right_hand", ours, lifetime_ns=1_000_000_005
        )
        assert made == fox.SceneUpdate(entities=[entity]).encode(), primitives


def test_a_recording_has_them_beside_ours(tmp_path: Path) -> None:
    path = write_hand(tmp_path / "a.mcap", RigConfig(folder=str(tmp_path)), 1.0)
    with path.open("rb") as file:
        found = [
            (channel.topic, None if kind is None else kind.name, message.log_time)
            for kind, channel, message in make_reader(file, validate_crcs=True).iter_messages()
        ]
    names = {(topic, name) for topic, name, _ in found}
    assert names == {
        ("rhot/desk/hand/right/pose", "rhot.HandPose"),
        ("foxglove/world", TRANSFORMS),
        ("foxglove/hand/right/frames", TRANSFORMS),
        ("foxglove/hand/right", SCENE),
    }
    # For us there are none: what was on the bus is what is read, counted and replayed.
    assert len(list(read(path))) == summarize(path).messages == 30
    assert list(summarize(path).keys) == ["rhot/desk/hand/right/pose"]
    path.write_bytes(path.read_bytes()[:-9])
    restored = recover(path)
    assert restored.messages == 30
    with restored.target.open("rb") as file:
        again = [(c.topic, m.log_time) for _, c, m in make_reader(file).iter_messages()]
    assert sorted(again) == sorted((topic, at) for topic, _, at in found)


def test_the_switch(tmp_path: Path) -> None:
    config = RigConfig(folder=str(tmp_path), recorder=RecorderTable(foxglove=False))
    path = write_hand(tmp_path / "a.mcap", config, 0.2)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        assert [c.topic for c in summary.channels.values()] == ["rhot/desk/hand/right/pose"]


def drawn(config: RigConfig, *poses: ObjectPose, meshes: dict[str, bytes] | None = None) -> list:
    scene = FoxgloveScene(config, meshes or {})
    return list(
        itertools.chain.from_iterable(
            scene.of(topics.OBJECT, msgspec.json.encode(pose)) for pose in poses
        )
    )


def test_an_objects_shape_stands_once_in_its_frame() -> None:
    mesh = ObjectTable(name="cup", serial="LHR-1", shape="mesh", mesh="x/Cup.GLB")
    for table in (
        ObjectTable(name="cup", serial="LHR-1", shape="cylinder", size_m=(0.07, 0.1)),
        ObjectTable(name="cup", serial="LHR-1", shape="box", size_m=(0.1, 0.2, 0.3)),
        ObjectTable(name="cup", serial="LHR-1", shape="sphere", size_m=(0.1,)),
        ObjectTable(name="cup", serial="LHR-1"),
        mesh,
    ):
        found = drawn(
            RigConfig(object=[table]), cup(), cup(), meshes={"meshes/cup.glb": b"glTF" * 9}
        )
        assert [one.channel for one in found] == [
            "foxglove/world",
            "foxglove/object/cup/frame",
            "foxglove/object/cup",
            "foxglove/object/cup/frame",
        ]
        assert (b"glTF" * 9 in found[2].data) == (table is mesh)


def test_what_is_not_in_the_rig_or_does_not_decode_is_not_drawn() -> None:
    assert drawn(RigConfig(), cup(registered=False), cup(tracking="lost")) == []
    scene = FoxgloveScene(RigConfig(), {})
    for payload in (b"", b"\xff", b"[" * 9000, b"{}"):
        assert list(scene.of(topics.POSE, payload)) == []


def test_attachments_hold_the_meshes(tmp_path: Path) -> None:
    (tmp_path / "Cup.STL").write_bytes(b"solid")
    table = ObjectTable(name="cup", serial="LHR-1", shape="mesh", mesh="Cup.STL")
    gone = msgspec.structs.replace(table, name="gone", mesh="no.stl")
    files = attachments(RigConfig(folder=str(tmp_path), object=[table, gone]))
    assert files["meshes/cup.stl"] == b"solid"
    assert set(files) == {"config.json", "meshes/cup.stl"}
