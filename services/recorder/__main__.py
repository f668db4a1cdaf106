"""rhot-recorder: records every session (or always: [recorder] autostart) as MCAP."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-recorder."""
    command("recorder", "services.recorder.service", __doc__)


if __name__ == "__main__":
    main()
