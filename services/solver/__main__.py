"""rhot-solver: see services/solver/service.py."""

from __future__ import annotations

from rhot.process.lifecycle import command
from services.solver.service import serve


def main() -> None:
    """Entry point of rhot-solver."""
    command("solver", serve)


if __name__ == "__main__":
    main()
