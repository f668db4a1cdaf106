"""rhot-fusion: turns the cameras' markers into 3D landmarks; master of session and clock."""

from __future__ import annotations

from rhot.process.lifecycle import command
from rhot.process.served import Companion

# Between them a message is half a millisecond of a pose's way.
_SOLVER = Companion(
    "solver",
    option="solve",
    module="services.solver.service",
    of=lambda config: config.has_depth,
    text="solve the hands of rigs in this process as well; else rhot-solver does",
)


def main() -> None:
    """Entry point of rhot-fusion."""
    command(
        "fusion",
        "services.fusion.service",
        __doc__,
        several_rigs=True,
        rigs_a_process=16,
        companion=_SOLVER,
    )


if __name__ == "__main__":
    main()
