"""What a router lets through at most: sizes by topic, rates by stream. Pure.

Against a publisher gone mad; nothing that a rig sends comes near (docs/guide/security.md has the
measurements). The sizes are those that receivers reject anyway (Topic.max_bytes), enforced before a
message is copied to each of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rhot import topics
from rhot.bus.security.credentials import SECURED
from rhot.files.config import RigConfig
from rhot.topics import Kind, Rate, Topic

# A PNG of noise is a little larger than its pixels, which are three bytes each.
_BYTES_PER_PIXEL = 3.2
# A message's key, attachment and framing.
_OVERHEAD_BYTES = 65_536
# Only on links from other machines: on this one a recording is replayed as fast as somebody likes.
# Zenoh lets a message pass if the last one is at least 1/rate old, so that the rate must bear
# frames that waited together for a stalled link. Measured on a busy machine, 10^5 messages/s of
# garbage by one camera, the other's 30 Hz at a subscriber of both: 21 Hz without a limit, 29.8 Hz
# with this one. A camera of 240 Hz with a tenth of its frames in such bursts loses 1.7 %; at a
# limit of 5 kHz it loses 11 %.
_STREAM_HZ = 20_000.0
# Settings, session and health change by hand, or once a second.
_SLOW_HZ = 200.0


def limits(*rigs: RigConfig) -> dict[str, Any]:
    """Zenoh's filters and bounds for the router of these rigs, of which there is one at least."""
    largest = max(_largest_message(topic, rigs) for topic in topics.TOPICS)
    return {
        "low_pass_filter": _sizes(rigs),
        "downsampling": _rates(rigs),
        "max_message_size": largest + _OVERHEAD_BYTES,
    }


def _largest_message(topic: Topic, rigs: Sequence[RigConfig]) -> int:
    """Bytes of the largest message of a topic: of pictures, that of the rigs' largest camera."""
    if topic.message is not None or not all(config.camera for config in rigs):
        return topic.max_bytes
    sizes_px = [camera.size_px for config in rigs for camera in config.camera]
    pixels = max(width * height for width, height in sizes_px)
    return min(topic.max_bytes, round(pixels * _BYTES_PER_PIXEL) + _OVERHEAD_BYTES)


def _sizes(rigs: Sequence[RigConfig]) -> list[dict[str, Any]]:
    by_size: dict[int, list[str]] = {}
    for topic in topics.TOPICS:
        if topic.kind is not Kind.TOKEN:
            by_size.setdefault(_largest_message(topic, rigs), []).append(topic.key("*"))
    return [
        {
            "id": f"at-most-{size}-bytes",
            "flows": ["ingress"],
            "messages": ["put", "query", "reply"],
            "size_limit": size,
            "key_exprs": keys,
        }
        for size, keys in sorted(by_size.items())
    ]


def _rates(rigs: Sequence[RigConfig]) -> list[dict[str, Any]]:
    # A rule counts all keys that it matches together: with wildcards, what one program sends at one
    # instant for two cameras would be one message too many.
    rules = [
        {"key_expr": key, "freq": _STREAM_HZ if _is_fast(topic) else _SLOW_HZ}
        for config in rigs
        for topic in topics.TOPICS
        if topic.kind in (Kind.STREAM, Kind.STATE)
        for key in _keys_of(topic, config)
    ]
    return [
        {
            "id": "rates",
            "flows": ["ingress"],
            "messages": ["put"],
            "link_protocols": list(SECURED),
            "rules": rules,
        }
    ]


def _keys_of(topic: Topic, config: RigConfig) -> list[str]:
    """Every key that a rig's programs send of a topic; health has a wildcard, one key a program."""
    names: dict[str, list[str]] = {
        "camera": [camera.name for camera in config.camera],
        "hand": [str(hand) for hand in config.hand],
        "serial": [item.serial for item in config.object],
        "object": [item.name for item in config.object],
    }
    if len(topic.fields) == 1 and topic.fields[0] in names:
        (field,) = topic.fields
        return [topic.key(config.rig.name, **{field: name}) for name in names[field]]
    return [topic.key(config.rig.name)]


def _is_fast(topic: Topic) -> bool:
    return topic.kind is Kind.STREAM and topic.rate not in (Rate.BEAT, Rate.DEMAND)
