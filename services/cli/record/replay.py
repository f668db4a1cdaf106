"""`rhot replay FILE`: a recording published again, in real time, faster, or flat out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
import uvloop

from rhot.process.lifecycle import cancelled_by, stop_on_signals
from services.cli.options import ConnectOption
from services.cli.router_session import reach, rig_and_endpoints
from services.cli.terminal import Teller
from services.recorder.reader import Record, Summary, summarize
from services.recorder.recover import recover as recover_file
from services.recorder.sources.replay import check_names
from services.recorder.sources.replay import replay as replay_file

# Records between two updates of the status line.
_TELL = 100


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
            f"{done.target}: {done.messages} messages restored, {done.damaged_chunks} damaged pieces left out"
        )
        return
    summary = summarize(file)
    if info:
        typer.echo(_text(file, summary))
        return
    check_names(only or ())
    typer.echo(
        f"replayed {uvloop.run(_replay(file, summary, config, connect, rate, loop, only or []))} messages"
    )


async def _replay(
    file: Path,
    summary: Summary,
    config: Path | None,
    connect: str | None,
    rate: float,
    loop: bool,
    only: list[str],
) -> int:
    stopping = stop_on_signals()
    rig, endpoints = rig_and_endpoints(config, connect)
    teller, sent = Teller(), 0

    def tell(record: Record) -> None:
        nonlocal sent
        sent += 1
        if sent % _TELL == 0:
            teller.status(
                f"{(record.log_time_ns - summary.start_ns) * 1e-9:.1f} of {summary.duration_s:.1f} s, {sent} messages"
            )

    with cancelled_by(stopping):
        async with reach(rig.rig.name, endpoints) as bus:
            await replay_file(bus, file, rate, loop=loop, only=only, report=tell)
    teller.end()
    return sent


def _text(file: Path, summary: Summary) -> str:
    lines = [
        f"{file}: rig {summary.rig!r}, {summary.messages} messages in {summary.duration_s:.1f} s"
    ]
    return "\n".join(
        lines + [f"  {count:8d}  {key}" for key, count in sorted(summary.keys.items())]
    )
