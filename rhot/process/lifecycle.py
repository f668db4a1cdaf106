"""The life of a service: from the command line over the event loop, signals and systemd to a clean
end.

A service is one coroutine, `serve(service)`. It runs in one TaskGroup together with the health beat
and the watchdog; whatever fails there ends the process with a message and a code (2: the user can
mend it, 1: a bug), and systemd or `rhot up` starts it anew. SIGTERM and SIGINT end it with code 0;
new calibration files end it with code 75, to be started with them at once.
While the router is away at start, the service waits for it. Fusion, solver, object tracker and
viewer may serve several rigs (rhot/process/rigs/); no thread interrupts their loop
(rhot/process/threads/thread_turns.py).
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import importlib
import logging
import math
import sys
import time
from collections.abc import AsyncIterator, Coroutine, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec

from rhot.bus.intake.rounds import Rounds
from rhot.errors import ConfigError, RhotError, disk_full, leaves
from rhot.files.config import RigConfig, load_rig
from rhot.process import logs, systemd
from rhot.process.calibration_watch import CalibrationChangedError
from rhot.process.event_loop import cancelled_by, run_loop, stop_on_signals
from rhot.process.extras import missing_extra
from rhot.process.options import command_for, is_much, service_parser
from rhot.process.restart_hold import hold_back
from rhot.process.rigs.files import have_own_names, load_of, rig_files
from rhot.process.rigs.keeper import RigKeeper
from rhot.process.rigs.shares import in_shares, keep_shares
from rhot.process.served import Companion, Serve, Served
from rhot.process.threads.allocator import share_one_heap
from rhot.process.threads.thread_turns import keep_the_turn

log = logging.getLogger("rhot.lifecycle")

EXIT_OK, EXIT_BUG, EXIT_USER = 0, 1, 2
# EX_TEMPFAIL of sysexits.h, "try again": nothing is wrong, the service wants to be started anew.
EXIT_AGAIN = 75


def command(
    name: str,
    module: str,
    about: str | None,
    instance_option: str = "instance",
    *,
    variants: Mapping[str, tuple[str, str]] = MappingProxyType({}),
    several_rigs: bool = False,
    rigs_a_process: int | None = None,
    companion: Companion | None = None,
) -> None:
    """The whole main() of a service: options, imports, logging, loop, exit code.

    module holds the coroutine `serve`. It is imported once the options are read, so that --help and
    --version need no extra of the package; about is what --help says. instance_option names the
    option that says which one of several this is, e.g. "camera"; any other than "instance" is
    required. variants are options without a value: each with the coroutine that it runs instead,
    and its help. several_rigs: --config may be given more than once, or be a folder; of more than
    rigs_a_process of two cameras at 30 fps each share has a process (rigs/shares.py). companion:
    what the process serves as well, if asked (served.py).
    """
    # Before anything starts a thread.
    share_one_heap()
    program = _program(name)
    parser = service_parser(
        program,
        about,
        instance_option,
        several_rigs=several_rigs,
        rigs_a_process=rigs_a_process,
        companion=companion,
    )
    for option, (own, text) in variants.items():
        parser.add_argument(f"--{option}", dest="serve", action="store_const", const=own, help=text)
    options = parser.parse_args()
    if not several_rigs and len(options.config) > 1:
        parser.error("--config is given twice; this service serves one rig")
    try:
        logs.set_up(f"{name}/{options.name}")
    except RhotError as error:
        parser.exit(EXIT_USER, f"{program}: error: {error}\n")
    # A share of one rig is one among others as well.
    together = rigs_a_process is not None and options.one_process
    several = several_rigs and (together or _are_several(options.config))
    if several and len(shares := _shares(options, rigs_a_process)) > 1:
        sys.exit(_run_shares(name, options, shares))
    try:
        serve: Serve = getattr(importlib.import_module(module), options.serve)
        if options.beside is not None:
            options.beside.imported()
    except ModuleNotFoundError as error:
        missing = missing_extra(error, program)
        if missing is None:
            raise
        parser.exit(EXIT_USER, f"{program}: error: {missing}\n")
    served = Served(name, options.name, serve, options.beside)
    if several:
        sys.exit(run_several(served, options.config, options.connect, in_rounds=options.rounds))
    sys.exit(run(served, options.config[0], options.connect, keeps_turn=several_rigs))


def run(
    served: Served, config_path: Path, connect: Sequence[str] = (), *, keeps_turn: bool = False
) -> int:
    """Run a service to its end; its exit code. connect replaces the endpoints of rig.toml.

    keeps_turn: all that counts happens in the event loop, which no thread is to interrupt. (Threads
    that wait for a camera or for SteamVR note when something came.)
    """
    started_s = time.monotonic()
    files = [config_path, config_path.parent / "calibration"]
    try:
        config = _load(config_path, connect)
        files = [config_path, config.calibration_dir]
        run_loop(_live(served.serve_rig(config), keeps_turn))
    except Exception as error:
        code = _explain(error, served.name, served.instance)
        if code != EXIT_AGAIN:
            hold_back(error, time.monotonic() - started_s, files)
        return code
    finally:
        systemd.notify("STOPPING=1")
    return EXIT_OK


def run_several(
    served: Served, paths: Sequence[Path], connect: Sequence[str] = (), *, in_rounds: bool = False
) -> int:
    """Run a service for all rigs of these files and folders, each on its own; its exit code.

    in_rounds: messages are asked for in rounds, also of few rigs.
    """
    rounds: Rounds | None = None
    keeper = RigKeeper(
        lambda path: _load(path, connect),
        lambda config: served.serve_rig(config, rounds),
        lambda error: _explain(error, served.name, served.instance) == EXIT_AGAIN,
    )
    try:
        files = rig_files(paths)
        rounds = Rounds() if in_rounds or is_much(load_of(files)) else None
        run_loop(_live(keeper.keep_all(files), keeps_turn=True))
    except Exception as error:
        return _explain(error, served.name, served.instance)
    finally:
        systemd.notify("STOPPING=1")
    return EXIT_OK


def _are_several(paths: Sequence[Path]) -> bool:
    """Whether rigs may be several. A file is one rig, and so it is beside folders without any."""
    try:
        return paths[0].is_dir() or len(rig_files(paths)) > 1
    except ConfigError:
        return True


def _shares(options: argparse.Namespace, most: int | None) -> list[list[Path]]:
    """The rigs' files, those of each process; what is wrong with them says who serves them."""
    try:
        files = rig_files(options.config)
    except ConfigError:
        return []
    # Of two rigs of one name, one process says what is wrong (keeper.py).
    if most is None or options.one_process or not have_own_names(files):
        return [files]
    return in_shares(files, math.ceil(load_of(files) / most))


def _run_shares(name: str, options: argparse.Namespace, shares: list[list[Path]]) -> int:
    """Run a process for each share of a service's rigs; the exit code of this one."""
    try:
        rounds = options.rounds or is_much(sum(map(load_of, shares)))
        work = keep_shares(shares, partial(command_for, options, rounds))
        run_loop(_live(work, keeps_turn=False, feeds=False))
    except Exception as error:
        return _explain(error, name, options.name)
    finally:
        systemd.notify("STOPPING=1")
    return EXIT_OK


def user_errors(error: Exception, program: str) -> list[RhotError]:
    """What the user can mend of an error or a group of them; empty if any of it is a bug.

    program is the command's name. A missing extra is the user's to install, and says how; a full
    disk is the user's to free, wherever it was met.
    """
    found = [missing_extra(leaf, program) or disk_full(leaf) or leaf for leaf in leaves(error)]
    errors = [leaf for leaf in found if isinstance(leaf, RhotError)]
    return errors if len(errors) == len(found) else []


def _program(name: str) -> str:
    return f"rhot-{name.replace('_', '-')}"


def _explain(error: Exception, name: str, instance: str) -> int:
    """Log what ended a service; its exit code."""
    ends = list(leaves(error))
    if all(isinstance(end, CalibrationChangedError) for end in ends):
        log.info("%s", ends[0])
        return EXIT_AGAIN
    errors = user_errors(error, _program(name))
    for one in errors:
        log.error("%s", one)
    if errors:
        systemd.tell_status("; ".join(map(str, errors)))
        return EXIT_USER
    log.error("%s %s failed", name, instance, exc_info=error)
    return EXIT_BUG


def _load(path: Path, connect: Sequence[str]) -> RigConfig:
    """The rig.toml; connect, if any, replaces its endpoints."""
    config = load_rig(path)
    if not connect:
        return config
    bus = msgspec.structs.replace(config.bus, connect=tuple(connect))
    return msgspec.structs.replace(config, bus=bus)


async def _live(work: Coroutine[Any, Any, None], keeps_turn: bool, feeds: bool = True) -> None:
    """Do the process's work until it ends, or a signal comes; feeds the watchdog meanwhile."""
    stopping = stop_on_signals()
    with cancelled_by(stopping):
        async with fed_watchdog() if feeds else contextlib.nullcontext():
            turn = asyncio.create_task(keep_the_turn()) if keeps_turn else None
            try:
                await work
            finally:
                if turn is not None:
                    turn.cancel()


@contextlib.asynccontextmanager
async def fed_watchdog() -> AsyncIterator[None]:
    """Tell systemd that the event loop turns, as long as the block lasts.

    A loop that is stuck says nothing and is restarted. Until the service is ready it asks for more
    time instead of being taken for dead: it may wait for its router.
    """

    async def feed(period_s: float) -> None:
        while True:
            systemd.notify("WATCHDOG=1")
            systemd.ask_for_time()
            await asyncio.sleep(period_s)

    period_s = systemd.watchdog_s()
    feeding = asyncio.create_task(feed(period_s)) if period_s is not None else None
    try:
        yield
    finally:
        if feeding is not None:
            feeding.cancel()
