"""The one base error of rhot.

Every error a user can meet derives from RhotError, and its message says three things: what is
wrong, which values are valid, and what to do next. The commands print it in one line; services log
it and exit.
"""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import msgspec

# What decoding untrusted JSON may raise. RecursionError: 5 kB of opening brackets are enough.
UNDECODABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)
# No space left, quota used up, or a file larger than the system lets this process write.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

# Why a request was refused: it does not decode; what it asks for cannot be; the service has no
# such thing; its machine could not keep the result; too many ask at once; it failed, which is a
# fault of the service.
RefusalCode = Literal["malformed", "invalid", "unsupported", "not_saved", "busy", "failed"]


class RhotError(Exception):
    """Base of every error rhot raises on purpose."""


class ConfigError(RhotError):
    """A file people write (rig.toml) is missing, malformed or contradicts itself."""


class CalibrationError(RhotError):
    """A file tools write (calibration/*.json) is missing, malformed or does not fit the data."""


class CaptureError(RhotError):
    """A capture, video or recording cannot be read or written."""


class DiskFullError(CaptureError):
    """A file could not be written for want of space; what was written of it may be incomplete.

    cause says so without advice, for who gives that anyway (the fault `disk_full`).
    """

    def __init__(self, cause: str) -> None:
        super().__init__(f"{cause}; free some space (`df -h` shows where), or write elsewhere")
        self.cause = cause


class SourceError(RhotError):
    """A camera or pose source cannot be opened, or has failed for good."""


class BusError(RhotError):
    """Zenoh refused a session, a key or a query."""


class RefusedError(RhotError):
    """A service refused a request; the reason travels as a Refusal message."""

    def __init__(self, reason: str, code: RefusalCode = "invalid") -> None:
        super().__init__(reason)
        self.code = code


def leaves(error: BaseException) -> Iterator[BaseException]:
    """The errors inside an ExceptionGroup, however deep, or the error itself."""
    if isinstance(error, BaseExceptionGroup):
        for inner in error.exceptions:
            yield from leaves(inner)
    else:
        yield error


def disk_full(error: BaseException, path: Path | None = None) -> DiskFullError | None:
    """The one line for a write that failed for want of space; None for every other error.

    path is the file, where the error itself does not name one (those of write and flush do not).
    """
    if not isinstance(error, OSError) or error.errno not in _FULL:
        return None
    where = path or error.filename or "a file"
    return DiskFullError(f"{where}: cannot be written: {error.strerror}")


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raises DiskFullError naming the file where the block fails for want of space."""
    try:
        yield
    except OSError as error:
        full = disk_full(error, path)
        if full is None:
            raise
        raise full from None
