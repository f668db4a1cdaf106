"""A node of ROS 2's on Zenoh: its publishers, and the tokens by which ROS's tools see them.

The session is a client of ROS's router; where that router goes and returns, the session takes keys
and tokens up again by itself.
"""

from __future__ import annotations

from typing import Any

import zenoh
import zenoh.ext

from rhot import clock
from services.bridges.ros2.encode import cdr, type_hash
from services.bridges.ros2.keys import (
    Distribution,
    RosTopic,
    attachment,
    gid_of,
    node_token,
)

# As rmw_zenoh_cpp asks subscribers of a kept topic to look for what they have missed.
_HEARTBEAT_S = 0.5


class RosNode:
    """The bridge as ROS sees it."""

    def __init__(self, session: zenoh.Session, domain: int, distribution: Distribution) -> None:
        self._session = session
        self._domain = domain
        self._distribution = distribution
        self._zid = str(session.zid())
        self._number = 0
        # A token lasts as long as somebody holds it.
        self._token = session.liveliness().declare_token(node_token(domain, self._zid))

    def publisher(self, topic: RosTopic) -> RosPublisher:
        """A publisher of one topic, and its token."""
        self._number += 1
        hashed = type_hash(topic, self._distribution)
        key = topic.key(self._domain, hashed)
        token = topic.token(self._domain, self._zid, self._number, hashed)
        return RosPublisher(self._session, topic, key, token)


class RosPublisher:
    """One topic; never blocks, what the network cannot take is dropped."""

    def __init__(self, session: zenoh.Session, topic: RosTopic, key: str, token: str) -> None:
        self._gid = gid_of(token)
        self._sequence = 0
        control = zenoh.CongestionControl.DROP
        self._publisher: Any
        if topic.kept:
            self._publisher = zenoh.ext.declare_advanced_publisher(
                session,
                key,
                congestion_control=control,
                cache=zenoh.ext.CacheConfig(topic.depth),
                publisher_detection=True,
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S
                ),
            )
        else:
            self._publisher = session.declare_publisher(key, congestion_control=control)
        self._token = session.liveliness().declare_token(token)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes; not of a kept topic, of which Zenoh does not tell."""
        return bool(self._publisher.matching_status.matching)

    def send(self, message: Any) -> None:
        """Publish a message of the topic's type."""
        self._sequence += 1
        extra = attachment(self._sequence, clock.now_ns(), self._gid)
        self._publisher.put(cdr(message), attachment=extra)
