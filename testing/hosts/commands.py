"""Commands on this machine: run to the end, or fail with what they said."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path


def run(
    command: Sequence[str | Path],
    timeout_s: float = 60.0,
    environment: Mapping[str, str] | None = None,
    check: bool = True,
) -> str:
    """What a command said, standard error included.

    Raises RuntimeError with the last of it if the command fails (unless check is False) or takes
    longer than timeout_s.
    """
    words = [str(word) for word in command]
    try:
        done = subprocess.run(
            words,
            env=None if environment is None else dict(environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired as late:
        said = late.stdout.decode(errors="replace") if isinstance(late.stdout, bytes) else ""
        raise RuntimeError(
            f"{' '.join(words)}: still not done after {timeout_s} s\n{said}"
        ) from None
    if check and done.returncode:
        raise RuntimeError(
            f"{' '.join(words)} ended with code {done.returncode}:\n{done.stdout[-4000:]}"
        )
    return done.stdout
