"""rhot-bridge: hands and objects for one other program; --instance is its name in rig.toml."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-bridge."""
    command("bridge", "services.bridges.service", __doc__)


if __name__ == "__main__":
    main()
