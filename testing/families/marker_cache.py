"""What takes long to make, kept on disk under a digest of what made it: a second run takes seconds.

In $RHOT_CACHE, or where rhot keeps its compiled kernels. A digest covers the recipe and every line
of the code that turns it into markers: a change of the tracker renders anew, one of fusion does
not. Files that cannot be read are made again.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar

from rhot.process.numba_cache import cache_root

Made = TypeVar("Made")
_ROOT = Path(__file__).parents[2]
# What the pictures depend on, and what the tracker makes of them.
PICTURE_CODE = (
    "rhot/files",
    "rhot/geometry",
    "rhot/hand.py",
    "rhot/hand_tables.py",
    "rhot/messages",
    "services/simulator",
    *(f"testing/families/{name}.py" for name in ("motions", "people", "picture_motions")),
    *(f"testing/families/{name}.py" for name in ("pictures", "recordings")),
)
MARKER_CODE = (*PICTURE_CODE, "services/pi_tracker")


@cache
def code_digest(folders: tuple[str, ...]) -> str:
    """Of these files of the source tree, and of every Python file below these folders."""
    digest = hashlib.sha256()
    for folder in folders:
        place = _ROOT / folder
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.relative_to(_ROOT).as_posix().encode() + b"\0")
            digest.update(path.read_bytes())
    return digest.hexdigest()


def kept(name: str, recipe: object, folders: tuple[str, ...], make: Callable[[], Made]) -> Made:
    """What `make` makes, from disk if it was made before of the same recipe by the same code.

    recipe must have a repr that says everything about it.
    """
    key = hashlib.sha256(f"{name}\0{recipe!r}\0{code_digest(folders)}".encode()).hexdigest()
    path = cache_root() / "families" / f"{name}-{key[:32]}.pickle.z"
    try:
        found: Made = pickle.loads(zlib.decompress(path.read_bytes()))
    except (OSError, zlib.error, pickle.UnpicklingError, EOFError):
        pass
    else:
        return found
    made = make()
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".{os.getpid()}")
    partial.write_bytes(zlib.compress(pickle.dumps(made), 6))
    partial.replace(path)
    return made
