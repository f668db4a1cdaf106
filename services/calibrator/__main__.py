"""rhot-calibrator: measures lenses, cameras, hands and objects, as the page asks."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-calibrator."""
    command("calibrator", "services.calibrator.service", __doc__)


if __name__ == "__main__":
    main()
