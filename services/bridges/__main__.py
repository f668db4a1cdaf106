"""rhot-bridge: hands and objects for one other program; --instance is its name in rig.toml."""

from __future__ import annotations

import contextlib
import os

from rhot.process.lifecycle import command

# Where cores are few, those who make poses go first.
_NICE = 10


def main() -> None:
    """Entry point of rhot-bridge."""
    # Before Zenoh's threads start, which take it over. Windows has no such thing, and systemd's
    # sandbox forbids it: the unit says Nice= instead.
    with contextlib.suppress(AttributeError, OSError):
        os.nice(_NICE)
    command("bridge", "services.bridges.service", __doc__)


if __name__ == "__main__":
    main()
