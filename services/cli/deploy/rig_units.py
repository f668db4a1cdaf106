"""Which systemd units a rig.toml asks for on the master, for deploy/install.sh.

`python -m services.cli.deploy.rig_units check|connect|secured|units|user-units rig.toml` prints one
answer a line. It needs no extra of the package: a Pi's installation has no typer.
"""

from __future__ import annotations

import sys
from pathlib import Path

from rhot.bus.security.credentials import is_secured
from rhot.errors import RhotError
from rhot.files.config import RigConfig, load_rig
from rhot.process.lifecycle import EXIT_OK, EXIT_USER


def master_units(config: RigConfig) -> list[str]:
    """Units of the master: what `rhot up` would run for the same file."""
    local = [camera for camera in config.camera if not camera.host]
    units = ["rhot-pi.target"] if local else []
    # For the page: the recorder starts, stops and replays recordings, the calibrator calibrates.
    always = ("router", "fusion", "viewer", "calibrator", "recorder")
    units += [f"rhot-{name}.service" for name in always]
    units += [f"rhot-pi-tracker@{camera.name}.service" for camera in local]
    if config.has_depth:
        units.append("rhot-solver.service")
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


def answer(question: str, config: RigConfig) -> list[str]:
    """Lines for one question: "check" has none, its answer is that the file can be read.

    Raises KeyError for a question that nobody answers.
    """
    return {
        "check": list[str],
        "connect": lambda: list(config.bus.connect),
        "secured": lambda: [one for one in config.bus.connect if is_secured(one)],
        "units": lambda: master_units(config),
        "user-units": lambda: user_units(config),
    }[question]()


def main() -> int:
    """Answer the question of the command line; its exit code."""
    question, path = sys.argv[1:]
    try:
        print("".join(f"{line}\n" for line in answer(question, load_rig(Path(path)))), end="")
    except RhotError as error:
        print(error, file=sys.stderr)
        return EXIT_USER
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
