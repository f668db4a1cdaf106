"""Keys, liveliness tokens and attachments as rmw_zenoh_cpp has them, so that ROS 2 takes the bridge
for one of its nodes. Pure.

After rmw_zenoh's design document and its sources (liveliness_utils.cpp, attachment_helpers.cpp,
qos.cpp; Apache-2.0):
  data      <domain>/<topic>/<type>/<type hash>
  node      @ros2_lv/<domain>/<zid>/<node>/<node>/NN/<enclave>/<namespace>/<name>
  publisher @ros2_lv/<domain>/<zid>/<node>/<id>/MP/<enclave>/<namespace>/<name>
                    /<topic>/<type>/<type hash>/<qos>
with `%` for each `/` inside a part. With each sample go its number, the time and the publisher's
id: 33 bytes, as in every Humble, in Jazzy since 0.2.4 (of June 2025) and in all later releases;
what an rmw_zenoh before that makes of them is an exception.
"""

from __future__ import annotations

import hashlib
import struct
from typing import Literal, NamedTuple

Distribution = Literal["humble", "jazzy"]

# Alike in rhot/bus/security/ros_keys.py, which lets them pass a rig's router; a test compares.
GRAPH, NODE = "@ros2_lv", "rhot_bridge"
# Humble has no hashes of types.
NO_HASH = "TypeHashNotSupported"
_EMPTY = "%"
# rmw_gid_t::data, as rmw_zenoh writes it.
_GID_BYTES = 16


class RosTopic(NamedTuple):
    """A topic of ROS's: its name with the leading slash, its type, its quality of service.

    kept says that late subscribers get the last message (transient local), depth how many are kept.
    """

    name: str
    type: str
    depth: int = 10
    kept: bool = False

    @property
    def qos(self) -> str:
        """Reliability:durability:history,depth:deadline:lifespan:liveliness.

        What is empty is rmw_zenoh's default: reliable, volatile, the last 42, automatic.
        """
        return f":{1 if self.kept else ''}:,{self.depth}:,:,:,,"

    @property
    def dds_type(self) -> str:
        """geometry_msgs/msg/PoseStamped -> geometry_msgs::msg::dds_::PoseStamped_"""
        package, kind, name = self.type.split("/")
        return f"{package}::{kind}::dds_::{name}_"

    def key(self, domain: int, type_hash: str) -> str:
        """Where its messages are published."""
        return f"{domain}/{self.name.strip('/')}/{self.dds_type}/{type_hash}"

    def token(self, domain: int, zid: str, number: int, type_hash: str) -> str:
        """What makes `ros2 topic list` show it; number tells the node's publishers apart."""
        topic = "/".join([_mangled(self.name), self.dds_type, type_hash, self.qos])
        return f"{_entity(domain, zid, number, 'MP')}/{topic}"


def node_token(domain: int, zid: str) -> str:
    """What makes `ros2 node list` show the bridge; zid is the id of its Zenoh session."""
    return _entity(domain, zid, 0, "NN")


def _entity(domain: int, zid: str, number: int, kind: str) -> str:
    # Enclave and namespace are ROS's empty ones.
    return f"{GRAPH}/{domain}/{zid}/0/{number}/{kind}/{_EMPTY}/{_EMPTY}/{NODE}"


def _mangled(name: str) -> str:
    return name.replace("/", "%")


def gid_of(token: str) -> bytes:
    """The id (16 bytes) of the publisher with that token: the same for as long as it lives.

    rmw_zenoh hashes the token with XXH3, for itself alone: nobody works out another's.
    """
    return hashlib.blake2b(token.encode(), digest_size=_GID_BYTES).digest()


def attachment(sequence: int, stamp_ns: int, gid: bytes) -> bytes:
    """What goes with a sample: int64 number, int64 nanoseconds since 1970, the id with its length.

    In zenoh-ext's serialisation: little endian, lengths as LEB128 (one byte below 128).
    """
    return struct.pack("<qqB", sequence, stamp_ns, len(gid)) + gid
