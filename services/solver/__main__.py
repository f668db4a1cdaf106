"""rhot-solver: solves the pose of every hand from its painted landmarks."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-solver."""
    command("solver", "services.solver.service", __doc__, several_rigs=True)


if __name__ == "__main__":
    main()
