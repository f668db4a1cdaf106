"""rhot-pi-tracker --config rig.toml --camera left"""

from __future__ import annotations

from rhot.process.lifecycle import command
from services.pi_tracker.service import serve


def main() -> None:
    """The command rhot-pi-tracker."""
    command("pi_tracker", serve, instance_option="camera")


if __name__ == "__main__":
    main()
