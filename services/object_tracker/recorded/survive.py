"""libsurvive's own recordings (`survive-cli --record FILE.rec.gz`), or what it printed. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rhot.errors import CaptureError
from rhot.messages.objects import OpenVrPose
from services.object_tracker.recorded.text_lines import text_lines
from services.object_tracker.survive_lines import SurviveParser, openvr_pose


def read_survive(path: Path) -> Iterator[OpenVrPose]:
    """The poses that libsurvive had computed when it recorded, in OpenVR's frame.

    Stamps count from the start of libsurvive, not from 1970. Serials are the devices' own. Raises
    CaptureError if it computed none.
    """
    parser, seq = SurviveParser(), 0
    for _, line in text_lines(path):
        pose = parser.feed(line)
        # Devices are told to be gone when the recording ends: that is no news of them.
        if pose is not None and pose.tracking == "ok":
            yield openvr_pose(pose, seq, round(min(pose.time_s, 9e9) * 1e9), parser.universe)
            seq += 1
    last = parser.flush()
    if last is not None and last.tracking == "ok":
        yield openvr_pose(last, seq, round(min(last.time_s, 9e9) * 1e9), parser.universe)
    elif seq == 0:
        raise CaptureError(
            f"{path}: no POSE lines: libsurvive recorded light and motion, but no poses;"
            f' let it compute them: [objects] source = "playback:{path.name}"'
        )
