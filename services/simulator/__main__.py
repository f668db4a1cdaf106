"""rhot-simulator: renders a virtual rig live: camera images, tracker poses and the truth."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-simulator."""
    command("simulator", "services.simulator.service", __doc__)


if __name__ == "__main__":
    main()
