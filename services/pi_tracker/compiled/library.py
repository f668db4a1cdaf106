"""The tracker's compiled form, if there is one for this machine: C that hatch_build.py compiled.

It is an ordinary shared library, called through ctypes, so that one file serves every Python. Where
it is missing, or was compiled from other sources than those beside it, `loaded` is None and the
tracker computes in Python, with the same results. Pure.
"""

from __future__ import annotations

import ctypes
import hashlib
import platform
import sys
from pathlib import Path

_ROOM = Path(__file__).parent
# Where the tracker's log names what it computes with.
REMEDY = "`pip install` compiles it where there is a C compiler (sudo apt install gcc)"


def place() -> Path:
    """Where the compiled form of this machine lies, if there is one."""
    return _ROOM / f"tracker-{sys.platform}-{platform.machine()}.so"


def load(path: Path) -> tuple[ctypes.CDLL | None, str]:
    """The library, and its state as a text for people."""
    if not path.is_file():
        return None, f"in Python: {path.name} is not there; {REMEDY}"
    try:
        library = ctypes.CDLL(str(path))
        compiled_from = ctypes.c_char_p.in_dll(library, "rhot_digest").value
    except (OSError, ValueError) as error:
        return None, f"in Python: {path.name} does not load ({error}); {REMEDY}"
    if compiled_from != _digest():
        return None, f"in Python: {path.name} is of another version; {REMEDY}"
    return library, f"compiled ({path.name})"


def _digest() -> bytes:
    """Alike in hatch_build.py, which compiles it in."""
    of = hashlib.sha256()
    for path in sorted(path for path in _ROOM.iterdir() if path.suffix in {".c", ".h"}):
        of.update(path.read_bytes())
    return of.hexdigest()[:16].encode()


loaded, state = load(place())
