"""Where the configuration that rhot ships is: config/ of the source tree, or the wheel's copy.

The wheel's copy lies beside this file: pyproject.toml (hatch, force-include) puts it there, so the
two cannot differ; a source tree has no copy. Commands only read the shipped files. What is written
goes into a copy or into the current folder.
"""

from __future__ import annotations

from pathlib import Path

from rhot.errors import ConfigError


def config_dir() -> Path:
    """The folder that holds sim.toml, rig.example.toml and calibration/.

    Raises ConfigError where the installation is incomplete.
    """
    here = Path(__file__).parent
    # The copy first: beside an installed package, ../../config would be some other package's.
    for folder in (here / "config", here.parents[1] / "config"):
        if (folder / "sim.toml").is_file():
            return folder
    raise ConfigError(
        f"{here / 'config'}: rhot's own sim.toml is missing; "
        "install rhot again, or name a file with --config"
    )


def sim_toml() -> Path:
    """The simulated rig of `rhot demo` and `rhot simulate`."""
    return config_dir() / "sim.toml"
