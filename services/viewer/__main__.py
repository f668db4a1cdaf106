"""rhot-viewer: see services/viewer/service.py."""

from __future__ import annotations

from rhot.process.lifecycle import command
from services.viewer.service import serve


def main() -> None:
    """Entry point of rhot-viewer."""
    command("viewer", serve)


if __name__ == "__main__":
    main()
