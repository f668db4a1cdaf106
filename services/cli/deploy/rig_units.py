"""What a rig.toml says of its master, systemd units above all, for deploy/install.sh.

`python -m services.cli.deploy.rig_units QUESTION rig.toml [FOLDER]`, the question being check,
name, connect, secured, units or user-units, prints one answer a line. FOLDER holds further rigs of
the same master, each in a folder of its own: what serves one is to run. It needs no extra of the
package: a Pi's installation has no typer.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rhot.bus.security.credentials import is_secured
from rhot.errors import RhotError
from rhot.files.config import RigConfig, load_rig
from rhot.process.lifecycle import EXIT_OK, EXIT_USER
from rhot.process.rigs.files import further_rigs, readable_rig


def master_units(config: RigConfig) -> list[str]:
    """Units of the master: what `rhot up` would run for the same file."""
    local = [camera for camera in config.camera if not camera.host]
    units = ["rhot-pi.target"] if local else []
    # For the page: the recorder starts, stops and replays recordings, the calibrator calibrates.
    always = ("router", "fusion", "viewer", "calibrator", "recorder")
    units += [f"rhot-{name}.service" for name in always]
    units += [f"rhot-pi-tracker@{camera.name}.service" for camera in local]
    if any(camera.source == "simulator" for camera in local):
        units.append("rhot-simulator.service")
    if config.object:
        units.append("rhot-object-tracker.service")
    if config.metrics.enabled:
        units.append("rhot-metrics.service")
    units += [f"rhot-bridge@{name}.service" for name in config.bridges.enabled]
    return units


def user_units(config: RigConfig) -> list[str]:
    """Units of whoever is logged in on the master: SteamVR is that user's."""
    steamvr = config.object and config.objects.source == "steamvr" and not config.objects.host
    return ["rhot-openvr-bridge.service"] if steamvr else []


def units_of_further_rigs(folder: Path) -> list[str]:
    """Units that serve all rigs of a master, and that rigs beside the first may ask for."""
    rigs = list(filter(None, map(readable_rig, further_rigs(folder))))
    return ["rhot-object-tracker.service"] if any(rig.object for rig in rigs) else []


def answer(question: str, config: RigConfig, folder: Path | None = None) -> list[str]:
    """Lines for one question: "check" has none, its answer is that the file can be read.

    folder: of further rigs, if any. Raises KeyError for a question that nobody answers.
    """
    further = units_of_further_rigs(folder) if folder else []
    return {
        "check": list[str],
        "name": lambda: [config.rig.name],
        "connect": lambda: list(config.bus.connect),
        "secured": lambda: [one for one in config.bus.connect if is_secured(one)],
        "units": lambda: list(dict.fromkeys([*master_units(config), *further])),
        "user-units": lambda: user_units(config),
    }[question]()


def main() -> int:
    """Answer the question of the command line; its exit code."""
    question, path, *folders = sys.argv[1:]
    folder = Path(folders[0]) if folders else None
    try:
        lines = answer(question, load_rig(Path(path)), folder)
        print("".join(f"{line}\n" for line in lines), end="")
    except RhotError as error:
        print(error, file=sys.stderr)
        return EXIT_USER
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
