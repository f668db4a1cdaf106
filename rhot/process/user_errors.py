"""Which errors are the user's to mend: those are one line and exit code 2, all others a bug's.

Ours (RhotError), a module that only an extra installs, and a disk that takes no more.
"""

from __future__ import annotations

import errno

from rhot.errors import RhotError, leaves
from rhot.process.extras import missing_extra

_DISK = {
    errno.ENOSPC: "the disk is full: free some space, `df -h` shows where",
    errno.EDQUOT: "the disk quota is used up: free some space or ask for more",
    errno.EROFS: "the file system is read-only: remount it, or name a folder elsewhere",
}


class DiskError(RhotError):
    """A file could not be written for want of space."""


def user_errors(error: Exception, program: str) -> list[RhotError]:
    """What the user can mend of an error or a group of them; empty if any of it is a bug.

    program is the command's name, e.g. "rhot-fusion": it decides which extra is the right one.
    """
    found = [disk_error(leaf) or missing_extra(leaf, program) or leaf for leaf in leaves(error)]
    errors = [leaf for leaf in found if isinstance(leaf, RhotError)]
    return errors if len(errors) == len(found) else []


def disk_error(error: BaseException) -> DiskError | None:
    """The one line for a disk that takes no more; None for every other error."""
    if not isinstance(error, OSError) or error.errno not in _DISK:
        return None
    where = f"{error.filename}: " if error.filename else ""
    return DiskError(f"{where}{_DISK[error.errno]}")
