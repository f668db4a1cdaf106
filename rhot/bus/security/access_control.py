"""Who may do what on the bus: Zenoh's `access_control`, derived from the table of topics. Pure.

On loopback, and by the master's certificate, everything; a camera's computer publishes and answers
for its own cameras; a viewer reads; an object source sends what SteamVR sees; partners (the routers
of other rigs) read like viewers and bring their own rigs' keys. Everybody else: nothing.

Zenoh judges a message twice: as it comes in ("ingress") and as it goes out ("egress"). Who learns
that somebody subscribes or answers is not restricted: declarations go out to all, data does not.
Names in certificates are compared whole, so that every certificate must follow from rig.toml; one
that no longer does is a stranger's from the router's next start.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from rhot import topics
from rhot.bus.security import ros_keys
from rhot.bus.security.roles import MASTER, Role, cameras_by_certificate, common_name
from rhot.files.config import RigConfig
from rhot.messages.recording import replay_rig
from rhot.topics import Kind, Topic

# Linux's and BSD's name of it.
LOOPBACK = ("lo", "lo0")
# Who shows a certificate is what it says, on this machine, too.
_PLAIN = ("tcp", "udp", "ws")
# Zenoh's `**` leaves out what begins with `@`: the router's own state has a rule of its own.
_EVERYTHING, _ADMIN = "**", "@/**"
_ALL_MESSAGES = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "declare_queryable",
    "reply",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
)
_DECLARATIONS = ("declare_subscriber", "declare_queryable")

# What somebody who only looks may see: every stream but the simulator's raw pictures.
SEEN = tuple(
    topic
    for topic in topics.TOPICS
    if topic is topics.SESSION or (topic.kind is Kind.STREAM and topic is not topics.SIM_FRAME)
)
# What may be asked without changing anything. A query with a payload changes colours and exposure
# or starts recording and replay, and Zenoh's rules do not look at payloads: those keys are the
# master's. What is replayed, only the master's recorder sends.
ASKED = (topics.SESSION, topics.CLOCK)


@dataclass
class _Subject:
    """Somebody, and the rules for them."""

    name: str
    who: dict[str, list[str]]
    rules: list[dict[str, Any]] = field(default_factory=list)

    def allow(self, flow: str, messages: Iterable[str], keys: Iterable[str]) -> None:
        keys = list(dict.fromkeys(keys))
        if keys:
            self.rules.append(
                {
                    "id": f"{self.name}-{flow}-{len(self.rules)}",
                    "permission": "allow",
                    "flows": [flow],
                    "messages": list(messages),
                    "key_exprs": keys,
                }
            )

    def does_all(self, keys: Iterable[str]) -> None:
        keys = list(keys)
        for flow in ("ingress", "egress"):
            self.allow(flow, _ALL_MESSAGES, keys)

    def publishes(self, keys: Iterable[str]) -> None:
        self.allow("ingress", ["put"], keys)

    def receives(self, keys: Iterable[str]) -> None:
        self.allow("egress", ["put", "delete"], keys)

    def subscribes(self, keys: Iterable[str]) -> None:
        self.allow("ingress", ["declare_subscriber"], keys)

    def asks(self, keys: Iterable[str]) -> None:
        keys = list(keys)
        self.allow("ingress", ["query"], keys)
        self.allow("egress", ["reply"], keys)

    def answers(self, keys: Iterable[str]) -> None:
        keys = list(keys)
        self.allow("ingress", ["declare_queryable", "reply"], keys)
        self.allow("egress", ["query"], keys)

    def is_alive(self, keys: Iterable[str]) -> None:
        self.allow("ingress", ["liveliness_token"], keys)

    def hears_of_others(self) -> None:
        """Which keys others subscribe to and answer: else nobody would send anything."""
        self.allow("egress", _DECLARATIONS, [_EVERYTHING])


def access_control(*rigs: RigConfig) -> dict[str, Any]:
    """The `access_control` of the router of these rigs; nothing is allowed that is not in here."""
    subjects = [_on_this_computer(rigs), *(one for config in rigs for one in _subjects(config))]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [rule for subject in subjects for rule in subject.rules],
        "subjects": [{"id": subject.name, **subject.who} for subject in subjects],
        "policies": [
            {"subjects": [subject.name], "rules": [rule["id"] for rule in subject.rules]}
            for subject in subjects
        ],
    }


def _on_this_computer(rigs: Iterable[RigConfig]) -> _Subject:
    here = _Subject("loopback", {"interfaces": list(LOOPBACK), "link_protocols": list(_PLAIN)})
    ros = [key for config in rigs for key in _keys_of_ros(config)]
    here.does_all([_EVERYTHING, _ADMIN, *ros])
    return here


def _subjects(config: RigConfig) -> list[_Subject]:
    """Everybody who has a certificate of one rig."""
    cameras = cameras_by_certificate(config).items()
    return [
        _master(config),
        *(_camera(config, name, of_it) for name, of_it in cameras),
        *(_object_source(config, name) for name in config.bus.object_sources),
        *(_viewer(config, name) for name in config.bus.viewers),
        *(_partner(config, rig) for rig in config.bus.partners),
    ]


def _holder(config: RigConfig, role: Role, name: str) -> _Subject:
    # Common names are told apart by the rig, and so are the ids of who has them.
    whole = common_name(config.rig.name, role, name)
    return _Subject(whole, {"cert_common_names": [whole]})


def _master(config: RigConfig) -> _Subject:
    subject = _holder(config, "master", MASTER)
    subject.does_all([_EVERYTHING, *_keys_of_ros(config)])
    return subject


def _keys_of_ros(config: RigConfig) -> list[str]:
    return ros_keys.graph_keys(config) if ros_keys.in_rigs_router(config) else []


def _camera(config: RigConfig, certificate: str, cameras: list[str]) -> _Subject:
    subject = _holder(config, "camera", certificate)
    rig = config.rig.name

    def keys(*of: Topic) -> list[str]:
        return [topic.key(rig, camera=camera) for topic in of for camera in cameras]

    def service(topic: Topic) -> list[str]:
        return [topic.key(rig, service="pi_tracker", instance=camera) for camera in cameras]

    settings = keys(topics.COLORS, topics.EXPOSURE)
    # Its own name's health: a service that has a namesake says so.
    own = service(topics.HEALTH)
    heard = [topics.SESSION.key(rig), *settings, *keys(topics.SIM_FRAME), *own]
    subject.publishes([*keys(topics.MARKERS, topics.PREVIEW), *own])
    subject.subscribes(heard)
    subject.receives(heard)
    subject.answers([*settings, *keys(topics.FIT, topics.FRAME)])
    subject.asks(topic.key(rig) for topic in ASKED)
    subject.is_alive(service(topics.ALIVE))
    subject.hears_of_others()
    return subject


def _object_source(config: RigConfig, name: str) -> _Subject:
    subject = _holder(config, "objects", name)
    rig = config.rig.name
    names = {"service": "openvr_bridge", "instance": name}
    poses, own = topics.OPENVR.key(rig), topics.HEALTH.key(rig, **names)
    # Who else sends poses, or runs under its name, it says.
    heard = [topics.SESSION.key(rig), poses, own]
    subject.publishes([poses, topics.OPENVR_EVENT.key(rig, host=name), own])
    subject.subscribes(heard)
    subject.receives(heard)
    subject.asks(topic.key(rig) for topic in ASKED)
    subject.is_alive([topics.ALIVE.key(rig, **names)])
    subject.hears_of_others()
    return subject


def _viewer(config: RigConfig, name: str) -> _Subject:
    subject = _holder(config, "viewer", name)
    own = config.rig.name
    _looks_on(subject, [own, replay_rig(own), *config.bus.partners])
    if ros_keys.in_rigs_router(config):
        _looks_on_in_ros(subject, config)
    return subject


def _looks_on_in_ros(subject: _Subject, config: RigConfig) -> None:
    """What the bridge to ROS 2 says, and that it is there; nothing of other nodes."""
    subject.receives(ros_keys.bridge_keys(config))
    # What is kept is asked for by other keys than it is answered with.
    subject.allow("egress", ["reply"], ros_keys.bridge_keys(config))
    # Heartbeats of what is kept are messages, too.
    kept = ros_keys.kept_keys(config)
    subject.asks(kept)
    subject.receives(kept)
    subject.subscribes(kept)
    watched = ros_keys.graph_keys(config)
    subject.allow("ingress", ["liveliness_query", "declare_liveliness_subscriber"], watched)
    subject.allow("egress", ["liveliness_token"], ros_keys.bridge_tokens(config))
    subject.allow("egress", _DECLARATIONS, kept)


def _looks_on(subject: _Subject, rigs: list[str]) -> None:
    # They may subscribe to as much as they like (`rhot/**`): what is sent to them is what counts.
    subject.subscribes([_EVERYTHING])
    subject.receives(topic.key(rig) for rig in rigs for topic in SEEN)
    # Clients that look at all rigs ask with a wildcard in the rig's place.
    subject.asks(topic.key(rig) for rig in [*rigs, "*"] for topic in ASKED)
    alive = [topics.ALIVE.key(rig) for rig in rigs]
    subject.allow("ingress", ["liveliness_query", "declare_liveliness_subscriber"], [_EVERYTHING])
    subject.allow("egress", ["liveliness_token"], alive)
    subject.hears_of_others()


def _partner(config: RigConfig, partner: str) -> _Subject:
    subject = _Subject(
        f"{config.rig.name}-partner-{partner}", {"cert_common_names": [_router_of(partner)]}
    )
    _looks_on(subject, [config.rig.name])
    theirs = [topic.key(partner) for topic in SEEN]
    subject.publishes(theirs)
    subject.answers(topic.key(rig) for rig in (partner, "*") for topic in ASKED)
    subject.is_alive([topics.ALIVE.key(partner)])
    subject.allow("egress", ["liveliness_query", "declare_liveliness_subscriber"], [_EVERYTHING])
    return subject


def _router_of(partner: str) -> str:
    return common_name(partner, "master", MASTER)
