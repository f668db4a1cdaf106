"""rhot-fusion: turns the cameras' markers into 3D landmarks; master of session and clock."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-fusion."""
    command("fusion", "services.fusion.service", __doc__, several_rigs=True, rigs_a_process=16)


if __name__ == "__main__":
    main()
