"""What a result was tracked from, and the rig that tracked it, as far as they are still there."""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot.errors import CaptureError
from rhot.files.config import RigConfig, load_rig
from services.cli.offline.results import SUMMARY
from services.cli.offline.track_summary import Origin, Summary


def summary_of_result(result: Path) -> Summary:
    """A result's summary.json. Raises CaptureError."""
    path = result / SUMMARY
    try:
        return msgspec.json.decode(path.read_bytes(), type=Summary)
    except (OSError, msgspec.DecodeError) as error:
        raise CaptureError(f"{path}: {error}; run `rhot track` into the folder again") from None


def rig_of_result(result: Path, rig_toml: Path | None = None) -> RigConfig | None:
    """The rig that tracked a result; None where its rig.toml is gone or there was none.

    rig_toml: of a recording, which brings its own. Raises ConfigError if the file is broken.
    """
    found = rig_toml_of(summary_of_result(result).origin, rig_toml)
    return None if found is None else load_rig(found)


def rig_toml_of(origin: Origin | None, rig_toml: Path | None = None) -> Path | None:
    """The rig.toml that is given, was named, or lies in the capture; None where none is there."""
    candidates = [rig_toml] if rig_toml is not None else []
    if origin is not None:
        candidates += [Path(origin.config)] if origin.config else []
        candidates += [Path(source) / "rig.toml" for source in origin.sources[:1]]
    return next((path for path in candidates if path.is_file()), None)
