"""Where compiled numba kernels are kept, so that a changed source never meets machine code of an
older one.

numba looks only at the file a kernel is written in: one that calls into a changed file goes on with
the old callee. So the folder's name carries a digest of all files with kernels. Services that
compile call `use_cache` in their package, before numba is imported. Another version of rhot with
the same kernels need not compile them: `adopt` takes them over.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
from pathlib import Path

_FOLDER = "RHOT_CACHE"
_NUMBA = "NUMBA_CACHE_DIR"
_PREFIX = "rhot-kernels-"
# In each folder: the path of the package whose kernels it holds. numba names subfolders after it.
_PLACE = "place.txt"


def cache_root() -> Path:
    """$RHOT_CACHE, systemd's $CACHE_DIRECTORY, or the user's cache folder; absolute."""
    for name in (_FOLDER, "CACHE_DIRECTORY"):
        # systemd lists several folders with colons between; the first is ours.
        if folder := os.environ.get(name, "").split(":")[0]:
            return Path(folder).absolute()
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").absolute() / "rhot"


def cache_folder(package: Path) -> Path:
    """The folder for the kernels that are written below `package` as they are now."""
    package = package.resolve()
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        source = path.read_bytes()
        if b"njit" in source:
            digest.update(str(path.relative_to(package)).encode() + b"\0" + source)
    # Another checkout on the same machine has a folder of its own, or `clear_old` of one would take
    # the other's.
    place = hashlib.sha256(str(package).encode()).hexdigest()[:8]
    return cache_root() / f"{_PREFIX}{place}-{digest.hexdigest()[:12]}"


def use_cache(package: Path) -> Path | None:
    """Make numba keep kernels in `cache_folder(package)`; returns the folder, None where somebody
    else has decided already.

    A NUMBA_CACHE_DIR that is not ours (a parent process may have left one of older sources) is
    kept. Where the folder cannot be written, numba's own choice stays: beside the sources.
    """
    decided = os.environ.get(_NUMBA, "")
    if "numba" in sys.modules or (decided and not Path(decided).name.startswith(_PREFIX)):
        return None
    try:
        folder = cache_folder(package)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _PLACE).write_text(str(package.absolute()))
    except (OSError, RuntimeError):  # RuntimeError: a user without a home
        return None
    if not os.access(folder, os.W_OK):
        return None
    os.environ[_NUMBA] = str(folder)
    return folder


def clear_old(package: Path) -> None:
    """Remove the folders of earlier states of the same package's sources."""
    current = cache_folder(package)
    place = current.name.rsplit("-", 1)[0]
    for folder in cache_root().glob(f"{place}-*"):
        if folder != current:
            shutil.rmtree(folder, ignore_errors=True)


def adopt(package: Path) -> Path | None:
    """Take over the kernels of the same sources from where they lay before (another version of
    rhot); returns the folder they came from, None if there are none, or it has its own already.
    """
    folder = cache_folder(package)
    if any(folder.rglob("*.nbc")):
        return None
    digest = folder.name.rpartition("-")[2]
    for other in sorted(cache_root().glob(f"{_PREFIX}*-{digest}")):
        with contextlib.suppress(OSError):
            before = Path((other / _PLACE).read_text())
            if other == folder or not any(other.rglob("*.nbc")):
                continue
            for room in [package, *sorted(package.rglob("*/"))]:
                old = other / _subfolder(before / room.relative_to(package))
                if old.is_dir():
                    new = folder / _subfolder(room.absolute())
                    shutil.copytree(old, new, dirs_exist_ok=True)
            return other
    return None


def _subfolder(room: Path) -> str:
    """Where numba (its UserProvidedCacheLocator) keeps the kernels of a folder's files."""
    return f"{room.name}_{hashlib.sha1(str(room).encode()).hexdigest()}"
