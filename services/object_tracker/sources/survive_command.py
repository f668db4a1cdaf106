"""How libsurvive is started on this machine: its own survive-cli, or the library inside the PyPI
package pysurvive, which has no survive-cli.
"""

from __future__ import annotations

import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

from rhot.errors import SourceError

PROGRAM = "survive-cli"
LIBRARY = "libsurvive.so"
# Poses, motion, logs. Light (each sensor's each sweep, 85 % of the lines) stays in the library.
OUTPUT = ("--record-stdout", "--no-record-angle", "--no-record-rawlight")
_RUNNER = "services.object_tracker.sources.survive_library"
INSTALL = (
    f"install libsurvive so that `{PROGRAM}` is on the PATH, or the PyPI package pysurvive"
    " (docs/guide/libsurvive.md), or choose another [objects] source"
)


def survive_command() -> tuple[str, ...]:
    """The command that runs libsurvive. Raises SourceError if it is not installed."""
    program = shutil.which(PROGRAM)
    if program is not None:
        return (program,)
    library = survive_library()
    if library is not None:
        return (sys.executable, "-m", _RUNNER, str(library))
    raise SourceError(f"there is no {PROGRAM} on the PATH; {INSTALL}")


def survive_library() -> Path | None:
    """libsurvive.so of the installed package pysurvive (which is not imported), None without it."""
    spec = find_spec("pysurvive")
    folders = (spec.submodule_search_locations or []) if spec is not None else []
    return next((Path(one) / LIBRARY for one in folders if (Path(one) / LIBRARY).is_file()), None)
