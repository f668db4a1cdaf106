"""`rhot replay FILE`: a recording published again, in real time, faster, or flat out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
import uvloop

from rhot.process.event_loop import cancelled_by, stop_on_signals
from services.cli.options import ConnectOption
from services.cli.router_session import rig_and_endpoints, router_session
from services.cli.terminal import Terminal
from services.recorder.reader import Record, Summary, summarize
from services.recorder.recover import recover as recover_file
from services.recorder.sources.replay import check_names
from services.recorder.sources.replay import replay as replay_file

# Messages between two updates of the status line.
_STATUS_EVERY = 100


@dataclass(frozen=True)
class _Playback:
    """How a file is replayed: see replay's options of the same names."""

    rate: float
    loop: bool
    only: list[str]


def replay(
    file: Annotated[
        Path, typer.Argument(help="recording (*.mcap) of `rhot record` or the recorder")
    ],
    config: Annotated[
        Path | None,
        typer.Option(help="rig.toml of the rig to play it to; default: the simulated rig's"),
    ] = None,
    rate: Annotated[
        float, typer.Option(min=0.0, help="1 is real time, 2 twice as fast, 0 flat out")
    ] = 1.0,
    loop: Annotated[
        bool, typer.Option("--loop", help="begin again at the end, until Ctrl-C")
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="a topic to replay, e.g. camera/markers; may be given again; default: all"
        ),
    ] = None,
    info: Annotated[bool, typer.Option("--info", help="show what is in the file and end")] = False,
    recover: Annotated[
        bool,
        typer.Option(
            "--recover", help="make a whole *.recovered.mcap of a file that was cut off and end"
        ),
    ] = False,
    connect: ConnectOption = None,
) -> None:
    """Publish a recording on its keys again, with its original stamps."""
    if recover:
        done = recover_file(file)
        typer.echo(
            f"{done.target}: {done.messages} messages restored, "
            f"{done.damaged_chunks} damaged pieces left out"
        )
        return
    summary = summarize(file)
    if info:
        typer.echo(_text(file, summary))
        return
    check_names(only or ())
    playback = _Playback(rate, loop, only or [])
    count = uvloop.run(_replay(file, summary, playback, config, connect))
    typer.echo(f"replayed {count} messages")


async def _replay(
    file: Path, summary: Summary, playback: _Playback, config: Path | None, connect: str | None
) -> int:
    stopping = stop_on_signals()
    rig, endpoints = rig_and_endpoints(config, connect)
    terminal, sent = Terminal(), 0

    def report(record: Record) -> None:
        nonlocal sent
        sent += 1
        if sent % _STATUS_EVERY == 0:
            at_s = (record.log_time_ns - summary.start_ns) * 1e-9
            terminal.status(f"{at_s:.1f} of {summary.duration_s:.1f} s, {sent} messages")

    with cancelled_by(stopping):
        async with router_session(rig.rig.name, endpoints) as bus:
            await replay_file(
                bus, file, playback.rate, loop=playback.loop, only=playback.only, report=report
            )
    terminal.end()
    return sent


def _text(file: Path, summary: Summary) -> str:
    counts = f"{summary.messages} messages in {summary.duration_s:.1f} s"
    lines = [f"{file}: rig {summary.rig!r}, {counts}"]
    lines += [f"  {count:8d}  {key}" for key, count in sorted(summary.keys.items())]
    return "\n".join(lines)
