"""Sources of tracked devices' poses behind one interface; `[objects] source` of rig.toml chooses.

libsurvive reads real lighthouses, replay a recording's poses, playback has libsurvive solve its own
recording again. With steamvr (rhot-openvr-bridge sends), simulator and network the poses are on the
bus already. A source that cannot be opened, or fails for good, raises SourceError; systemd (or
`rhot up`) tries again.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator
from pathlib import Path
from typing import Protocol

from rhot.errors import SourceError
from rhot.files.config import RigConfig
from rhot.messages.objects import OpenVrPose
from services.object_tracker.recorded.recording import UNNAMED
from services.object_tracker.sources.libsurvive import LibSurvive, Playback
from services.object_tracker.sources.replay import Replay


class PoseSource(Protocol):
    """A source of poses."""

    def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Poses as they come; ends with the source, raises SourceError when it fails."""
        ...


def open_source(config: RigConfig) -> PoseSource | None:
    """The source that rig.toml names, or None if poses are on the bus already.

    Raises SourceError for an unknown name.
    """
    table = config.objects
    kind, _, detail = table.source.partition(":")
    match kind:
        case "steamvr" | "simulator" | "network" if not detail:
            return None
        case "libsurvive" if not detail:
            return LibSurvive(table.arguments)
        case "playback" if detail:
            return Playback(Path(config.folder) / detail, table.arguments)
        case "replay" if detail:
            # A recording that names no device is of the rig's one object.
            serial = config.object[0].serial if len(config.object) == 1 else UNNAMED
            path = Path(config.folder) / detail
            return Replay(path, serial, speed=table.speed, loop=table.loop)
    raise SourceError(
        f"[objects] source = {table.source!r} is unknown;"
        " valid: steamvr, libsurvive, replay:FILE, playback:FILE.rec.gz, simulator, network"
    )
