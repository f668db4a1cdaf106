"""Everything an installation without a network needs, in one folder of wheels.

What comes from elsewhere is collected once for each pyproject.toml; rhot's own wheel is built anew.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from testing.hosts.commands import run

ROOT = Path(__file__).parents[2]
# Not this environment's Python: the one that install.sh makes its environments with.
PYTHON = "/usr/bin/python3"
_EXTRAS = ("master", "pi")
_COLLECT_S = 900.0


def collect(folder: Path) -> Path:
    """The folder, filled with what both roles need."""
    folder.mkdir(parents=True, exist_ok=True)
    python = folder.parent / "venv" / "bin" / "python"
    if not python.exists():
        run([PYTHON, "-m", "venv", folder.parent / "venv"], _COLLECT_S, _environment())
    for old in folder.glob("rhot-*.whl"):
        old.unlink()
    digest = hashlib.sha256((ROOT / "pyproject.toml").read_bytes()).hexdigest()
    done = folder.parent / "wheels.digest"
    pip = [python, "-m", "pip", "--disable-pip-version-check"]
    wheel = [*pip, "wheel", "--quiet", "--wheel-dir", folder]
    if done.exists() and done.read_text() == digest:
        run([*wheel, "--no-deps", ROOT], _COLLECT_S, _environment())
    else:
        # Each by itself: a Pi needs another numpy than the master.
        for extra in _EXTRAS:
            run([*wheel, f"{ROOT}[{extra}]"], _COLLECT_S, _environment())
        done.write_text(digest)
    return folder


def _environment() -> dict[str, str]:
    hidden = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"}
    return {name: value for name, value in os.environ.items() if name not in hidden}
