"""rhot-pi-tracker: finds the coloured markers in one camera's images."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-pi-tracker."""
    command("pi_tracker", "services.pi_tracker.service", __doc__, instance_option="camera")


if __name__ == "__main__":
    main()
