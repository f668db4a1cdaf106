"""A recording of a right hand that pinches, of a rig with two cameras and a cup."""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot import topics
from rhot.files.config import RigConfig
from services.recorder.recorder import attachments
from services.recorder.writer import RecordingWriter
from testing.hand_stream import pose_at

START_NS = 1_760_000_000_000_000_000
_HZ = 30


def write_hand(path: Path, config: RigConfig, seconds: float = 6.0) -> Path:
    """Poses of the rig's right hand, 30 a second, pinched at each half second."""
    with RecordingWriter(path, config.rig.name, "1", attachments(config)) as writer:
        for seq in range(round(seconds * _HZ)):
            at_s = seq / _HZ
            stamp_ns = START_NS + round(at_s * 1e9)
            pose = msgspec.json.encode(pose_at(at_s, stamp_ns, seq))
            writer.add(topics.POSE, topics.POSE.key(config.rig.name, hand="right"), pose, stamp_ns)
    return path
