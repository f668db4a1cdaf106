"""Where compiled numba kernels are kept, so that a changed source never meets machine code of an
older one.

numba looks only at the file a kernel is written in: one that calls into a changed file goes on with
the old callee. So the folder's name carries a digest of all files with kernels. Services that
compile call `use_cache` in their package, before numba is imported. Another version or place of
rhot with the same kernels need not compile them, some minutes on two cores: it takes them over.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import sys
import tempfile
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
        if not folder.is_dir():
            adopt(package)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _PLACE).write_text(str(package.absolute()))
    except (OSError, RuntimeError):  # RuntimeError: a user without a home
        return None
    if not os.access(folder, os.W_OK):
        return None
    os.environ[_NUMBA] = str(folder)
    return folder


def clear_old(package: Path) -> None:
    """Remove the folders of earlier states of the same package's sources, and of packages that are
    gone.
    """
    current = cache_folder(package)
    place = current.name.rsplit("-", 1)[0]
    for folder in cache_root().glob(f"{_PREFIX}*"):
        if folder != current and (folder.name.startswith(f"{place}-") or _is_left(folder)):
            shutil.rmtree(folder, ignore_errors=True)


def _is_left(folder: Path) -> bool:
    """Whether the package whose kernels a folder holds is gone."""
    with contextlib.suppress(OSError):
        return not Path((folder / _PLACE).read_text()).exists()
    return False


def adopt(package: Path) -> Path | None:
    """Take over the kernels of the same sources from where they lay before (another version of
    rhot); returns the folder they came from, None if there are none, or it has its own already.
    """
    folder = cache_folder(package)
    if _count(folder):
        return None
    digest = folder.name.rpartition("-")[2]
    # Of one that is compiling right now there are few.
    for other in sorted(cache_root().glob(f"{_PREFIX}*-{digest}"), key=_count, reverse=True):
        with contextlib.suppress(OSError):
            if _count(other):
                _take_over(package, folder, other)
                return other
    return None


def _count(folder: Path) -> int:
    """How many kernels a folder holds."""
    return sum(1 for _ in folder.rglob("*.nbc"))


def _take_over(package: Path, folder: Path, other: Path) -> None:
    """Copy kernels to `folder`, each subfolder at once: other services may start meanwhile."""
    before = Path((other / _PLACE).read_text())
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as copies:
        for room in [package, *sorted(package.rglob("*/"))]:
            old = other / _subfolder(before / room.relative_to(package))
            if old.is_dir():
                new = _subfolder(room.absolute())
                copy = shutil.copytree(old, Path(copies) / new)
                with contextlib.suppress(OSError):  # another one was faster
                    copy.rename(folder / new)


def _subfolder(room: Path) -> str:
    """Where numba (its UserProvidedCacheLocator) keeps the kernels of a folder's files."""
    return f"{room.name}_{hashlib.sha1(str(room).encode()).hexdigest()}"
