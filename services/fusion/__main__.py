"""rhot-fusion: see services/fusion/service.py."""

from __future__ import annotations

from rhot.process.lifecycle import command
from services.fusion.service import serve


def main() -> None:
    """Entry point of rhot-fusion."""
    command("fusion", serve)


if __name__ == "__main__":
    main()
