"""rhot-simulator: see services/simulator/service.py."""

from __future__ import annotations

from rhot.process.lifecycle import command
from services.simulator.service import serve


def main() -> None:
    """Entry point of rhot-simulator."""
    command("simulator", serve)


if __name__ == "__main__":
    main()
