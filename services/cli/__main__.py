"""The program `rhot`: runs the command line; what a user can mend is one line and exit code 2."""

from __future__ import annotations

import os
import sys

# Before numpy is there, and as the units have it. On a computer that tracks meanwhile, threads of
# BLAS spin: `rhot calibrate objects` took four times the processor's time, and eight times as long.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from rhot.errors import leaves
from rhot.plain_text import printable
from rhot.process import logs
from rhot.process.lifecycle import EXIT_USER, user_errors
from rhot.process.service import rhot_version

PROGRAM = "rhot"


def main() -> None:
    """Entry point of rhot."""
    # The same as the option of application.py, but without typer, which an installation of the core
    # dependencies alone does not have.
    if sys.argv[1:] == ["--version"]:
        print(rhot_version())
        return
    try:
        logs.set_up_command(PROGRAM)
        # Not above: where typer is missing, these imports fail, and the user gets one line.
        if sys.argv[1:2] == ["router"]:
            # All wait for the router when it has died: the other commands' imports take as long
            # again as its own start.
            from services.cli.live.router import application
        else:
            from services.cli.application import application
        application()()
    except Exception as error:
        if all(isinstance(leaf, BrokenPipeError) for leaf in leaves(error)):
            # Nobody reads on, as after `rhot top | head`: typer's own end, which knows no groups.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(1)
        errors = user_errors(error, PROGRAM)
        if not errors:
            raise
        for one in errors:
            print(f"{PROGRAM}: error: {printable(str(one))}", file=sys.stderr)
        sys.exit(EXIT_USER)


if __name__ == "__main__":
    main()
