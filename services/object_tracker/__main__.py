"""rhot-object-tracker: tracks objects by libsurvive, a file or the bus."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-object-tracker."""
    command("object_tracker", "services.object_tracker.service", __doc__, several_rigs=True)


if __name__ == "__main__":
    main()
