"""rhot-recorder: see services/recorder/service.py."""

from __future__ import annotations

from rhot.process.lifecycle import command
from services.recorder.service import serve


def main() -> None:
    """Entry point of rhot-recorder."""
    command("recorder", serve)


if __name__ == "__main__":
    main()
