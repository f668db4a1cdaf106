"""The points of one hand in a recording of any kind."""

from __future__ import annotations

import tempfile
from pathlib import Path

from rhot import topics
from rhot.errors import CaptureError
from rhot.hand import HandName
from rhot.messages import HandPoints
from services.cli.recorded.messages import messages as messages_of


def recorded(path: Path, which: HandName, config: Path | None) -> list[HandPoints]:
    """The points of one hand in a recording of any kind.

    Raises CaptureError if there is none, and what reading it raises.
    """
    if path.is_file() or (path / "points.jsonl").is_file():
        found = list(messages_of(path, topics.POINTS, HandPoints, "points"))
    elif (path / "rig.toml").is_file():
        from services.cli.offline.inputs import job_of
        from services.cli.offline.run import run

        with tempfile.TemporaryDirectory() as folder:
            tracked = Path(folder) / "out"
            run(job_of([str(path)], config), tracked, None)
            found = list(messages_of(tracked, topics.POINTS, HandPoints, "points"))
    else:
        raise CaptureError(f"{path}: is no capture, result of `rhot track`, points.jsonl or .mcap")
    return [message for message in found if message.hand == which]
