"""Modules that only an extra of the package installs, and the command that installs the extra.

`pip install rhot` brings the core dependencies alone. A program that needs more says so in one line
(exit code 2), wherever the import fails: at its start or inside one of its commands.
"""

from __future__ import annotations

from rhot.errors import RhotError

# The module as it is imported -> the extra of pyproject.toml that installs it.
EXTRAS = {
    "cryptography": "master",
    "cv2": "master",
    "foxglove": "bridges",
    "matplotlib": "study",
    "mcap": "master",
    "numba": "master",
    "openvr": "openvr",
    "pythonosc": "bridges",
    "prometheus_client": "master",
    "pyarrow": "tables",
    "rosbags": "bridges",
    "scipy": "master",
    "trimesh": "master",
    "typer": "master",
    "viser": "master",
    "websockets": "bridges",
}
# On a Raspberry Pi, which needs less than the master.
_PI_PROGRAM, _PI_EXTRAS = "rhot-pi-tracker", {"cv2": "pi"}


class MissingExtraError(RhotError):
    """A module cannot be imported because the extra that brings it is not installed."""


def missing_extra(error: BaseException, program: str) -> MissingExtraError | None:
    """The one line for a failed import of a module in EXTRAS; None for every other error.

    program is the command's name, e.g. "rhot-fusion": it decides which extra is the right one.
    """
    if not isinstance(error, ModuleNotFoundError) or not error.name:
        return None
    module = error.name.partition(".")[0]
    extras = EXTRAS | _PI_EXTRAS if program == _PI_PROGRAM else EXTRAS
    if module not in extras:
        return None
    return MissingExtraError(
        f"needs {module}, which is not installed; run `pip install 'rhot[{extras[module]}]'`"
    )
