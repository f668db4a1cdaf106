"""`rhot check CONFIG`: every problem of a rig.toml and of all it refers to, before anything runs.

Exit code 0 without errors, 1 with one; --strict counts warnings as errors.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from services.cli.check.problems import Report, report
from services.cli.rig.answers import Answers, ask_rig
from services.cli.rig.certificates import certificate_problem
from services.cli.rig.machine import addresses_of, is_this_machine, steamvr_registry
from services.cli.rig.place import place_of
from services.cli.rig.ports import taken_ports


def check(
    config: Annotated[Path, typer.Argument(help="rig.toml to check")],
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="exit with 1 on warnings too")] = False,
) -> None:
    """List every problem of a rig.toml: keys, colours, calibrations, sources, network.

    Run on the master, it also asks the trackers that run; on a Pi it looks at what lives there.
    """
    found = check_config(config)
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(found), indent=1).decode())
    else:
        typer.echo(report_text(found))
    if found.count("error") or (strict and found.count("warning")):
        raise typer.Exit(1)


def check_config(config: Path) -> Report:
    """All findings on one rig.toml, as this machine's place in the rig wants it."""
    from services.cli.check.calibration import check_calibration
    from services.cli.check.machines import (
        check_certificates,
        check_hosts,
        check_ports,
        check_router,
    )
    from services.cli.check.rig import check_rig
    from services.cli.check.running import check_remote_cameras, questions_to
    from services.cli.check.toml import read_rig

    rig, problems = read_rig(config)
    if rig is None:
        return report(str(config), problems)
    place = place_of(rig, is_this_machine)
    taken = taken_ports(rig.bus.listen) if place.master else {}
    questions = questions_to(rig, place)
    asks = questions or taken or not place.master
    answers = ask_rig(rig, questions) if asks else Answers()
    problems += check_rig(rig, config, place, steamvr_registry())
    problems += check_calibration(rig, place)
    problems += check_hosts(rig, config, place, addresses_of)
    problems += check_certificates(rig, certificate_problem(rig, place))
    if place.master:
        problems += check_ports(rig, config, taken, answers)
        problems += check_remote_cameras(rig, config, place, answers)
    else:
        problems += check_router(rig, config, answers)
    return report(str(config), problems)


def report_text(found: Report) -> str:
    """One line per finding, and a line that counts them."""
    width = max((len(problem.severity) for problem in found.problems), default=0)
    lines = [
        f"{problem.severity.ljust(width)}  {problem.where}: {problem.what}"
        for problem in found.problems
    ]
    counts = [
        f"{found.count(severity)} {severity}{'' if found.count(severity) == 1 else 's'}"
        for severity in ("error", "warning", "note")
    ]
    return "\n".join([*lines, f"{found.config}: {', '.join(counts)}"])
