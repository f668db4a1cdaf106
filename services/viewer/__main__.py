"""rhot-viewer: shows the rig live at http://127.0.0.1:8080 (or [viewer] port)."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-viewer."""
    command("viewer", "services.viewer.service", __doc__, several_rigs=True)


if __name__ == "__main__":
    main()
