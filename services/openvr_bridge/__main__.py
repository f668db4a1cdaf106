"""rhot-openvr-bridge: sends what SteamVR tracks, from the machine that it runs on."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-openvr-bridge."""
    command("openvr_bridge", "services.openvr_bridge.service", __doc__)


if __name__ == "__main__":
    main()
