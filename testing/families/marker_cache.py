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

from rhot.kernels.numba_cache import cache_root
from testing.source_tree import relative, uses

Made = TypeVar("Made")
_HERE = Path(__file__).parent
# What makes pictures here; what they import counts too.
_MAKERS = ("motions", "people", "picture_motions", "pictures", "recordings")


@cache
def code_digest(*, tracker: bool) -> str:
    """Of all code that makes pictures and, if wanted, of the tracker that finds markers in them."""
    return digest_of(*(_HERE / f"{name}.py" for name in _MAKERS), tracker=tracker)


def digest_of(*paths: Path, tracker: bool) -> str:
    """Of files and all that they import, if wanted with the tracker's."""
    files: set[Path] = set()
    found = set(paths)
    while found:
        files |= found
        used = {path for file in found for path in uses(file)}
        found = {path for path in used - files if tracker or "pi_tracker" not in path.parts}
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(relative(path).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def kept(name: str, recipe: object, make: Callable[[], Made], *, tracker: bool) -> Made:
    """What `make` makes, from disk if it was made before of the same recipe by the same code.

    recipe must have a repr that says everything about it; tracker: the tracker's code counts too.
    """
    code = code_digest(tracker=tracker)
    key = hashlib.sha256(f"{name}\0{recipe!r}\0{code}".encode()).hexdigest()
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
