"""`rhot replay FILE`: a recording published again, in real time, faster, or flat out."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
import uvloop

from rhot.bus.bus import Bus
from rhot.errors import ConfigError
from rhot.process.event_loop import cancelled_by, stop_on_signals
from services.cli.options import ConnectOption
from services.cli.router_session import rig_and_endpoints, router_session
from services.cli.terminal import Terminal
from services.recorder.pace import window
from services.recorder.reader import Summary, summarize
from services.recorder.recover import recover as recover_file
from services.recorder.sources.playback import Playback, check_names
from services.recorder.sources.replay import publishing

_STATUS_PERIOD_S = 0.2


FromOption = Annotated[
    float | None,
    typer.Option("--from", metavar="SECONDS", help="begin here; negative: so long before the end"),
]
ToOption = Annotated[
    float | None, typer.Option("--to", metavar="SECONDS", help="end here; likewise")
]
ViewOption = Annotated[
    bool,
    typer.Option("--view", help="show it on the page: needs no rig, and goes on until Ctrl-C"),
]


@dataclass(frozen=True)
class _How:
    """How a file is replayed: see replay's options of the same names."""

    rate: float
    loop: bool
    only: list[str]
    window_ns: tuple[int, int]


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
    from_s: FromOption = None,
    to_s: ToOption = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="a topic to replay, e.g. camera/markers; may be given again; default: all"
        ),
    ] = None,
    view: ViewOption = False,
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
        typer.echo(_recovered(file))
        return
    summary = summarize(file)
    if info:
        typer.echo(_text(file, summary))
        return
    check_names(only or ())
    if view:
        _view(file, rate, loop, window(summary, from_s, to_s), config or connect or only)
        return
    how = _How(rate, loop, only or [], window(summary, from_s, to_s))
    count = uvloop.run(_replay(file, how, config, connect))
    typer.echo(f"replayed {count} messages")


async def _replay(file: Path, how: _How, config: Path | None, connect: str | None) -> int:
    stopping = stop_on_signals()
    rig, endpoints = rig_and_endpoints(config, connect)
    terminal, sent = Terminal(), 0
    with cancelled_by(stopping):
        async with router_session(rig.rig.name, endpoints) as bus:
            playback = _playback(bus, file, how)
            showing = asyncio.create_task(_show(playback, terminal))
            try:
                await playback.run()
            finally:
                sent = playback.sent
                showing.cancel()
    terminal.end()
    return sent


def _view(file: Path, rate: float, loop: bool, window_ns: tuple[int, int], others: object) -> None:
    if others:
        raise ConfigError("--view has a router and a rig of its own: leave --config, --connect out")
    if rate == 0.0:
        raise ConfigError("--view needs a --rate above 0: nobody sees what is played flat out")
    # Not above: the page's neighbours take long to import.
    from services.cli.record.view import view

    uvloop.run(view(file, rate, loop, window_ns))


def _playback(bus: Bus, file: Path, how: _How) -> Playback:
    return Playback(
        file,
        bus.rig,
        publishing(bus, patient=True),
        rate=how.rate,
        loop=how.loop,
        only=how.only,
        window_ns=how.window_ns,
    )


async def _show(playback: Playback, terminal: Terminal) -> None:
    """Where the playing is, in the status line, for ever."""
    summary = playback.summary
    while True:
        at_s = (playback.position_ns - summary.start_ns) * 1e-9
        terminal.status(f"{at_s:.1f} of {summary.duration_s:.1f} s, {playback.sent} messages")
        await asyncio.sleep(_STATUS_PERIOD_S)


def _recovered(file: Path) -> str:
    done = recover_file(file)
    return (
        f"{done.target}: {done.messages} messages restored, "
        f"{done.damaged_chunks} damaged pieces left out"
    )


def _text(file: Path, summary: Summary) -> str:
    counts = f"{summary.messages} messages in {summary.duration_s:.1f} s"
    lines = [f"{file}: rig {summary.rig!r}, {counts}"]
    lines += [f"  {count:8d}  {key}" for key, count in sorted(summary.keys.items())]
    return "\n".join(lines)
