"""Keys, tokens and attachments against rmw_zenoh's own and a deserialiser we did not write."""

from __future__ import annotations

from pathlib import Path

import msgspec
import zenoh
from zenoh.ext import Int64, UInt8, z_deserialize

from rhot.bus.security import ros_keys
from rhot.files.bridge_tables import Bridges, Ros2
from rhot.files.config import load_rig
from services.bridges.ros2.encode import type_hash
from services.bridges.ros2.keys import RosTopic, attachment, gid_of, node_token
from services.bridges.ros2.topics import (
    MARKERS,
    TF,
    TF_STATIC,
    all_topics,
    joints,
    object_pose,
    wrist,
)

# `ros2 topic info -v` of a Jazzy machine prints these.
HASHES = {
    TF: "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    MARKERS: "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    wrist("right"): "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    joints("left"): "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
}


def test_hashes_are_those_of_ros():
    for topic, expected in HASHES.items():
        assert type_hash(topic, "jazzy") == expected
        assert type_hash(topic, "humble") == "TypeHashNotSupported"


def test_keys_are_those_of_rmw_zenoh():
    # As rmw_zenoh's design document has it for /chatter, and for a name with two parts.
    chatter = RosTopic("/chatter", "std_msgs/msg/String")
    assert chatter.key(0, "RIHS01_df66") == "0/chatter/std_msgs::msg::dds_::String_/RIHS01_df66"
    assert wrist("right").key(7, "H") == (
        "7/rhot/right_hand/wrist/geometry_msgs::msg::dds_::PoseStamped_/H"
    )
    for topic in (TF, TF_STATIC, MARKERS, wrist("left"), object_pose("a.b-c")):
        zenoh.KeyExpr(topic.key(0, HASHES[TF]))  # raises if Zenoh would refuse it


def test_tokens_are_those_of_rmw_zenoh():
    """The publisher's is what a real one of /tf declares: reliable, volatile, the last 100."""
    assert node_token(0, "a1b2") == "@ros2_lv/0/a1b2/0/0/NN/%/%/rhot_bridge"
    assert TF.token(0, "a1b2", 3, HASHES[TF]) == (
        "@ros2_lv/0/a1b2/0/3/MP/%/%/rhot_bridge/%tf/tf2_msgs::msg::dds_::TFMessage_/"
        f"{HASHES[TF]}/::,100:,:,:,,"
    )
    # Transient local is 1 in rmw_qos_durability_policy_e.
    assert TF_STATIC.qos == ":1:,1:,:,:,,"
    assert "/%rhot%left_hand%wrist/" in wrist("left").token(0, "a1b2", 1, "H")


def test_an_attachment_is_read_by_zenohs_own_deserialiser():
    gid = gid_of(TF.token(0, "a1b2", 3, "H"))
    content = attachment(41, 1_700_000_000_123_456_789, gid)
    assert len(content) == 33  # what rmw_zenoh's readers expect
    # A std::array<uint8_t, 16> goes as a sequence of bytes.
    read = z_deserialize(tuple[Int64, Int64, list[UInt8]], zenoh.ZBytes(content))
    assert read == (41, 1_700_000_000_123_456_789, list(gid))
    assert gid != gid_of(TF.token(0, "a1b2", 4, "H"))
    assert len(gid) == 16


def test_names_of_objects_become_names_of_ros():
    assert object_pose("blue-cup.2").name == "/rhot/object_blue_cup_2/pose"


def test_a_router_that_lets_the_bridges_keys_pass_lets_all_of_them_pass():
    rig = load_rig(Path(__file__).parents[4] / "config" / "sim.toml")
    config = msgspec.structs.replace(rig, bridges=Bridges(ros2=Ros2(enabled=True, domain=7)))
    published = [zenoh.KeyExpr(key) for key in ros_keys.bridge_keys(config)]
    seen = [zenoh.KeyExpr(key) for key in ros_keys.bridge_tokens(config)]
    graph = [zenoh.KeyExpr(key) for key in ros_keys.graph_keys(config)]
    tokens = [node_token(7, "a1b2")]
    for number, topic in enumerate(all_topics(config)):
        assert any(key.includes(topic.key(7, "H")) for key in published)
        tokens.append(topic.token(7, "a1b2", number, "H"))
    for token in tokens:
        assert any(key.includes(token) for key in seen)
        assert any(key.includes(token) for key in graph)
    other = zenoh.KeyExpr("@ros2_lv/7/a1b2/0/0/NN/%/%/somebody")
    assert not any(key.includes(other) for key in seen)
