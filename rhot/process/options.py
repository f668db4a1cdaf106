"""The options of a service's command, and how it is started again with some of them."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from rhot.process.served import Companion
from rhot.process.service import rhot_version

_SEVERAL = "rig.toml; several of them, or a folder of *.toml (or */rig.toml): each rig on its own"
_ROUNDS = "ask for messages in rounds, as is done for %d rigs (2 cameras at 30 fps) a core and more"
_TOGETHER = "serve all rigs in this process; else %d rigs (2 cameras at 30 fps) or so have one each"


# From so many usual rigs on (rigs/files.py) messages are asked for in rounds
# (rhot/bus/intake/rounds.py). In turn on two cores, twice, poses take (median, 99 %, ms), called
# back and in rounds: of 20 rigs 5, 70 and 12, 129, then 7, 27 and 5, 21; of 16 1.9, 13 and 2.2, 23,
# then 3.1, 11 and 3.0, 18.
RIGS_A_PROCESSOR = 9.0


def is_much(load: float) -> bool:
    """Whether so many usual rigs keep this computer busy."""
    return load >= RIGS_A_PROCESSOR * (os.cpu_count() or 1)


def service_parser(
    program: str,
    about: str | None,
    instance_option: str,
    *,
    several_rigs: bool,
    rigs_a_process: int | None = None,
    companion: Companion | None = None,
) -> argparse.ArgumentParser:
    """The options of a service: see rhot.process.lifecycle.command."""
    parser = argparse.ArgumentParser(prog=program, description=about)
    parser.add_argument(
        "--config",
        type=Path,
        required=True,
        action="append",
        help=_SEVERAL if several_rigs else "rig.toml",
    )
    required = instance_option != "instance"
    parser.add_argument(
        f"--{instance_option}",
        dest="name",
        required=required,
        default="main",
        help="which one this is",
    )
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        help="router endpoint, instead of [bus] connect of rig.toml",
    )
    if several_rigs:
        parser.add_argument("--rounds", action="store_true", help=_ROUNDS % RIGS_A_PROCESSOR)
    if rigs_a_process is not None:
        parser.add_argument("--one-process", action="store_true", help=_TOGETHER % rigs_a_process)
    if companion is not None:
        option = f"--{companion.option}"
        parser.add_argument(
            option, dest="beside", action="store_const", const=companion, help=companion.text
        )
    parser.add_argument("--version", action="version", version=rhot_version())
    parser.set_defaults(
        serve="serve", rounds=False, one_process=rigs_a_process is None, beside=None
    )
    return parser


def command_for(options: argparse.Namespace, rounds: bool, files: Sequence[Path]) -> list[str]:
    """The command that serves some of the rigs in one process, as this one was started."""
    given = len(sys.argv) - 1
    command = [*sys.orig_argv[: len(sys.orig_argv) - given], "--one-process"]
    command += ["--instance", options.name, *(["--rounds"] if rounds else [])]
    if options.beside is not None:
        command.append(f"--{options.beside.option}")
    for endpoint in options.connect:
        command += ["--connect", endpoint]
    for file in files:
        command += ["--config", str(file)]
    return command
