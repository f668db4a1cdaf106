"""`rhot tune filter RECORDING`: parameters of the 1-Euro filter for one's own hand and cameras.

Record the hand held still for some seconds, then moving as fast as it will, with `method =
"triangulate"` and `filter = "none"`; the RECORDING is the folder that `rhot track` wrote, its
points.jsonl, or an MCAP file of `rhot record`. Points that were filtered already (another method)
still give a proposal, which is then a second filter's. A recording without a still or without a
fast stretch is an error.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from rhot import topics
from rhot.messages import HandPoints
from services.cli.options import menu
from services.cli.recorded.messages import messages

if TYPE_CHECKING:
    from services.fusion.paired.one_euro_tuning import Proposal

tune = menu("tune", "Propose settings from recordings.")


@tune.callback()
def _group() -> None:
    """Makes typer keep `filter` as a subcommand, although it is the only one."""


@tune.command(name="filter")
def tune_filter(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING", help="result folder of `rhot track`, points.jsonl, or .mcap"
        ),
    ],
    jitter: Annotated[
        float,
        typer.Option(
            min=0.05, max=1.0, help="wanted jitter at rest, as a share of the unfiltered one"
        ),
    ] = 0.5,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """Propose mincutoff and beta of the 1-Euro filter: still hand first, then fast hand."""
    # Not above: importing the package fusion prepares numba's cache, which other commands do not
    # need.
    from services.fusion.paired import one_euro_tuning, recorded_tracks

    proposal = one_euro_tuning.propose(
        recorded_tracks.tracks(messages(recording, topics.POINTS, HandPoints, "points")), jitter
    )
    typer.echo(msgspec.json.encode(proposal).decode() if as_json else _text(proposal))


def _text(proposal: Proposal) -> str:
    """The table, and what to paste."""
    lines = [
        f"still {proposal.still_s:.1f} s, jitter {proposal.noise_mm:.2f} mm on each axis",
        f"moving {proposal.moving_s:.1f} s, {proposal.speed_m_s:.2f} m/s RMS",
        "",
        "jitter at rest   mincutoff_hz     beta   error in motion      lag",
    ]
    for row in proposal.rows:
        mark = "  <- proposed" if row == proposal.best else ""
        lines.append(
            f"{row.jitter_mm:8.2f} mm {100 * row.jitter_share:3.0f} % {row.mincutoff_hz:11.2f} "
            f"{row.beta:8.1f} {row.error_mm:12.2f} mm {row.lag_ms:8.0f} ms{mark}"
        )
    best = proposal.best
    lines += [
        "",
        "[fusion.one_euro]",
        f"mincutoff_hz = {best.mincutoff_hz:g}",
        f"beta = {best.beta:g}",
    ]
    return "\n".join(lines)
