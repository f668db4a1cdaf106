"""What streams and services are to a person, where the bus has keys and names. Pure."""

from __future__ import annotations

import html
import re

from rhot import topics
from rhot.topics import Topic
from rhot.watch.onlooker_faults import about

# By topic: one stream, and all of its kind.
_STREAMS: dict[str, tuple[str, str]] = {
    topics.MARKERS.template: ("markers of camera {camera}", "markers of the cameras"),
    topics.POINTS.template: ("points of the {hand} hand", "points of the hands"),
    topics.POSE.template: ("pose of the {hand} hand", "poses of the hands"),
    topics.OPENVR.template: ("tracker {serial}", "trackers of SteamVR"),
    topics.OPENVR_EVENT.template: ("events of SteamVR", "events of SteamVR"),
    topics.OBJECT.template: ("pose of {object}", "poses of the objects"),
    topics.CONTACTS.template: ("touches of {object}", "touches of the objects"),
    topics.CAPTION.template: ("what a tour explains", "what a tour explains"),
    topics.TRUTH.template: ("the simulator's truth", "the simulator's truth"),
    topics.PREVIEW.template: ("pictures of camera {camera}", "pictures of the cameras"),
    topics.SIM_FRAME.template: ("simulated pictures of {camera}", "simulated pictures"),
    topics.HEALTH.template: ("health of {service}", "health of the programs"),
}
_KEY = re.compile(r"\brhot(?:-[a-z]+)?/[\w.*-]+/[\w.*/-]*[\w*]")
_COMMAND = re.compile(r"`([^`]{1,200})`")


def text(value: str, longest: int = 60) -> str:
    """Any string, made harmless for a browser and shortened."""
    return html.escape("".join(c for c in value if c.isprintable())[:longest])


def stream_words(key: str) -> str:
    """`pose of the right hand`; what is not the bus's own as it is."""
    topic = topics.find(key)
    if topic is None:
        return key
    return _of_topic(topic, topic.names(key) or {})


def service_words(service: str, instance: str) -> str:
    """`the tracker of camera left`."""
    return about(service, instance)


def plain(value: str) -> str:
    """A sentence with the keys in it as words."""
    return _KEY.sub(lambda match: stream_words(match[0]), value)


def sentence(value: str, longest: int = 300) -> str:
    """A sentence as HTML: harmless, its keys as words, its commands set apart."""
    return _COMMAND.sub(r"<code>\1</code>", text(plain(value), longest))


def _of_topic(topic: Topic, names: dict[str, str]) -> str:
    one, every = _STREAMS.get(topic.template, (topic.name, topic.name))
    if any(name == "*" for name in names.values()):
        return every
    for field, name in names.items():
        one = one.replace("{" + field + "}", name)
    return one
