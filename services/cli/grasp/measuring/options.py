"""The options of `rhot grasp measure`, in groups."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer


@dataclass(frozen=True)
class SeedOptions:
    """Where the joints are in the first picture."""

    seed: Annotated[
        list[str] | None,
        typer.Option(
            metavar="JOINT=X,Y",
            help="a joint's pixel in the first picture, as index_pip=512,300; once for each joint "
            "(index_mcp, index_pip, index_dip, index_tip, thumb_cmc, thumb_mp, thumb_ip, "
            "thumb_tip; of the base line index_wrist, or index_b1 and index_b2 with edges)",
        ),
    ] = None
    seeds: Annotated[
        Path | None, typer.Option(metavar="FILE.json", help='{"index_tip": [512, 300], ...}')
    ] = None
    click: Annotated[
        bool, typer.Option("--click", help="click on the joints on a page of this machine")
    ] = False
    base: Annotated[
        str | None,
        typer.Option(
            metavar="X1,Y1,X2,Y2",
            help="base line of the MCP angle, two pixels towards the finger, at rest in the "
            "picture; default: b1 to b2, else wrist to knuckle, else thumb_cmc to index_mcp",
        ),
    ] = None
    flexion: Annotated[
        Literal["auto", "clockwise", "counterclockwise"],
        typer.Option(help="which way the finger closes on the screen; auto: as it bends most"),
    ] = "auto"


@dataclass(frozen=True)
class LookOptions:
    """How joints are found."""

    method: Annotated[
        Literal["dots", "edges", "edges-paper"],
        typer.Option(
            help="dots painted on the joints, the edges of a plain finger, or edges with the "
            "paper's centroids as joints, for comparison"
        ),
    ] = "dots"
    hsv: Annotated[
        str | None,
        typer.Option(
            metavar="H,S,V-H,S,V", help="range of the dots' colour; default: found at the seeds"
        ),
    ] = None
    color: Annotated[
        str | None, typer.Option(help="the dots' colour by its name in the file of --colors")
    ] = None
    colors: Annotated[
        Path | None,
        typer.Option(metavar="FILE.colors.json", help="written by `rhot calibrate colors`"),
    ] = None


@dataclass(frozen=True)
class ScaleOptions:
    """What makes pixels millimetres, and seconds."""

    lens: Annotated[
        Path | None,
        typer.Option(metavar="FILE.lens.json", help="lens calibration: pictures are corrected"),
    ] = None
    straight: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="instead of --lens: points along edges that are straight in the world, as "
            "[[[x, y], ...], ...], pixels of the first picture",
        ),
    ] = None
    length: Annotated[
        list[str] | None,
        typer.Option(metavar="BONE_mm=MM", help="a known length, as index_proximal_mm=43.6"),
    ] = None
    scale_mm_per_px: Annotated[
        float | None, typer.Option("--scale-mm-per-px", help="millimetres a pixel")
    ] = None
    reference: Annotated[
        str | None,
        typer.Option(
            metavar="rectangle=WxH:X,Y:X,Y:X,Y:X,Y",
            help="a rectangle of known size (mm) in the finger's plane, its corners' pixels in the "
            "first picture in order: tilt and scale are taken from it; or length=MM:X,Y:X,Y",
        ),
    ] = None
    fps: Annotated[
        float | None,
        typer.Option(min=0.1, max=10_000, help="frame rate, instead of the video's own times"),
    ] = None
