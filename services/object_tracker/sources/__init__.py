"""Sources of tracked devices' poses behind one interface; `[objects] source` of rig.toml chooses.

steamvr and libsurvive read real lighthouses, replay reads an objects.jsonl. With simulator and
network the poses are on the bus already. A source that cannot be opened, or fails for good, raises
SourceError; systemd (or `rhot up`) tries again.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable
from pathlib import Path
from typing import Protocol

from rhot.errors import SourceError
from rhot.files.config import RigConfig
from rhot.messages.objects import OpenVrPose
from services.object_tracker.sources.libsurvive import LibSurvive
from services.object_tracker.sources.replay import Replay
from services.object_tracker.sources.steamvr import SteamVr

Report = Callable[[str], None]


class PoseSource(Protocol):
    """A source of poses."""

    def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Poses as they come; ends with the source, raises SourceError when it fails."""
        ...


def open_source(config: RigConfig, report: Report) -> PoseSource | None:
    """The source that rig.toml names, or None if poses are on the bus already.

    report takes warnings: what a user should know although the source goes on. Raises SourceError
    for an unknown name.
    """
    kind, _, detail = config.objects.source.partition(":")
    match kind:
        case "simulator" | "network" if not detail:
            return None
        case "steamvr" if not detail:
            return SteamVr(config.objects.rate_hz, report)
        case "libsurvive" if not detail:
            return LibSurvive()
        case "replay" if detail:
            return Replay(Path(config.folder) / detail)
    raise SourceError(
        f"[objects] source = {config.objects.source!r} is unknown;"
        " valid: steamvr, libsurvive, replay:FILE (an objects.jsonl), simulator, network"
    )
