"""`rhot grasp rectify PICTURE|VIDEO`: a plane as seen squarely, and lengths in it, from one view.

The plane is known by a rectangle of known size, or by edges of its two directions and one length.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rhot.errors import ConfigError
from services.cli.option_groups import grouped
from services.cli.options import ProgressOption

if TYPE_CHECKING:
    from rhot.geometry.transforms import Array
    from services.cli.grasp.planes import Image, Straight
    from studies.grasp.metrology.plane import Plane

_TWO = "two points, as '410,52 550,60'"


@dataclass(frozen=True)
class PlaneOptions:
    """What is known of the plane. Pixels are the picture's own, lens and all."""

    points: Annotated[
        str | None,
        typer.Option(help="a rectangle's corners in order, as 'x,y x,y x,y x,y' in pixels"),
    ] = None
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="the rectangle's width and height, mm")
    ] = None
    edge_x: Annotated[
        list[str] | None,
        typer.Option(help=f"instead of a rectangle: an edge along the plane's x, {_TWO}; twice"),
    ] = None
    edge_y: Annotated[
        list[str] | None, typer.Option(help="likewise across, at right angles to x; twice")
    ] = None
    between: Annotated[
        str | None, typer.Option(help=f"with edges: the ends of the known length, {_TWO}")
    ] = None
    length: Annotated[
        float | None, typer.Option(help="with edges: that length, mm; alone: a square view")
    ] = None
    sigma: Annotated[
        float, typer.Option(min=0.01, max=50.0, help="how well points are pointed at, px")
    ] = 1.0
    refine: Annotated[
        bool, typer.Option(help="look for the rectangle's own edges near what was pointed at")
    ] = True


@dataclass(frozen=True)
class LensOptions:
    """What is known of the lens."""

    lens: Annotated[
        Path | None, typer.Option(metavar="FILE.lens.json", help="of `rhot calibrate lens`")
    ] = None
    straight: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="points along edges that are straight in the world, as [[[x, y], ...], ...]: the"
            " lens's bend is found from them",
        ),
    ] = None
    nearer: Annotated[
        float,
        typer.Option(help="the plane to be shown is so much nearer to the camera, mm (--lens)"),
    ] = 0.0


@grouped
def rectify(
    picture: Annotated[Path, typer.Argument(metavar="PICTURE | VIDEO", help="what one camera saw")],
    out: Annotated[Path, typer.Option("--out", "-o", help="folder for the results")],
    known: PlaneOptions,
    seen: LensOptions,
    distance: Annotated[
        list[str] | None, typer.Option(help=f"measure a distance in the plane: {_TWO}")
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option(min=0.001, max=1000.0, help="px per mm; default: the picture's"),
    ] = None,
    progress: ProgressOption = None,
) -> None:
    """Show a plane of a picture or video squarely, and measure in it."""
    # Not above: OpenCV takes longer to import than other commands take to run.
    from services.cli.grasp.planes import first_picture, measure_distance, straight_of, write
    from services.cli.progress import Progress

    image = first_picture(picture)
    straight = straight_of((image.shape[1], image.shape[0]), seen.lens, seen.straight)
    plane, about, words = _plane(known, straight, image)
    if seen.nearer:
        plane = _nearer(plane, seen, straight)
    for text in distance or []:
        typer.echo(measure_distance(plane, straight, text, known.sigma))
    line = Progress("rectifying", 0, progress)
    for path in write(picture, out, plane, straight, about, scale, line.advance):
        typer.echo(path)
    line.end()
    typer.echo(words)
    typer.echo(straight.about)


def _plane(known: PlaneOptions, straight: Straight, image: Image) -> tuple[Plane, Array, str]:
    """The plane, and the points (n, 2) px it is known by, of a picture without distortion; how
    well it is known.
    """
    import numpy as np

    from studies.grasp.metrology.plane import plane_from_view
    from studies.grasp.metrology.reference import Reference, parse_points, parse_size
    from studies.grasp.metrology.view import view_from_edges

    if known.points is not None:
        if known.size is None:
            raise ConfigError("--points without --size: how large is the rectangle? --size 80x36")
        rectangle = Reference(parse_size(known.size), parse_points(known.points, 4))
        found = straight.known(rectangle, known.sigma, image if known.refine else None)
        return found.plane, found.seen.points_px, found.about()
    if known.between is None or known.length is None:
        raise ConfigError(
            "no reference: give --points and --size of a rectangle, or --between and --length of a"
            " known length (with --edge-x and --edge-y where the camera does not look squarely)"
        )
    ends = straight.straighten(parse_points(known.between, 2))
    if not (known.edge_x or known.edge_y):
        length = Reference((known.length,), parse_points(known.between, 2))
        found = straight.known(length, known.sigma, None)
        return found.plane, ends, f"{found.about()}; the camera is taken to look squarely"
    groups = [
        [straight.straighten(parse_points(text, 2)) for text in texts or []]
        for texts in (known.edge_x, known.edge_y)
    ]
    view = view_from_edges(
        np.array(groups[0]),
        np.array(groups[1]),
        straight.size_px,
        sigma_px=known.sigma,
        matrix=straight.calibrated,
    )
    plane = plane_from_view(view, ends[0], ends[1], known.length, known.sigma)
    about = (
        f"edges: focal length {view.focal_px:.0f} px +- {100 * view.covariance[3, 3] ** 0.5:.0f} %"
    )
    return plane, np.concatenate([ends, *groups[0], *groups[1]]), about


def _nearer(plane: Plane, seen: LensOptions, straight: Straight) -> Plane:
    from studies.grasp.metrology.space import space_from_lens

    if straight.calibrated is None:
        raise ConfigError(
            f"--nearer {seen.nearer:g}: how a plane looks before another one needs the lens's focal"
            " length; calibrate it (`rhot calibrate lens`) and give --lens"
        )
    return space_from_lens(plane, straight.calibrated).parallel_plane(-seen.nearer)
