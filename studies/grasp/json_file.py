"""Files of the study, read: one message each, as the study's own commands write it."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

import msgspec

from rhot.errors import CaptureError

T = TypeVar("T")


def read_json(path: Path, kind: type[T], otherwise: str) -> T:
    """The message in a file; raises CaptureError, which says `otherwise` of one that holds none."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=kind)
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read: {error.strerror}") from None
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise CaptureError(f"{path}: is {otherwise} ({error})") from None
