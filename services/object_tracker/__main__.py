"""rhot-object-tracker: see services/object_tracker/service.py."""

from __future__ import annotations

from rhot.process.lifecycle import command
from services.object_tracker.service import serve


def main() -> None:
    """Entry point of rhot-object-tracker."""
    command("object_tracker", serve)


if __name__ == "__main__":
    main()
