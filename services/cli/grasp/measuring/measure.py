"""`rhot grasp measure VIDEO|FRAMES --out DIR`: a finger's joint angles, lengths and path, picture
by picture, from dots on its joints or from its edges.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rhot.errors import CaptureError, writing
from services.cli.grasp.measuring.options import LookOptions, ScaleOptions, SeedOptions
from services.cli.option_groups import grouped
from services.cli.options import ProgressOption

if TYPE_CHECKING:
    from rhot.files.calibration import ColorRange
    from services.pi_tracker.image.frame import Image
    from studies.grasp.measure.joints import Finger, Seen
    from studies.grasp.measure.pictures import Pictures
    from studies.grasp.measure.recordings import Finding, Line, Wanted
    from studies.grasp.measure.seeds import Method, Seeds
    from studies.grasp.metrology.reference import Known

_GRID = "first-frame.png"


@grouped
def measure(
    video: Annotated[Path, typer.Argument(metavar="VIDEO | FRAMES", help="file, or folder")],
    out: Annotated[Path, typer.Option("--out", "-o", help="folder for the results")],
    at: SeedOptions,
    look: LookOptions,
    scaled: ScaleOptions,
    subject: Annotated[str | None, typer.Option(help="who; default: the video's name")] = None,
    overlay: Annotated[
        bool, typer.Option("--overlay/--no-overlay", help="a video of what was measured")
    ] = True,
    progress: ProgressOption = None,
) -> None:
    """Measure a finger's joint angles in a video: one JSON and one CSV for each finger."""
    # Not above: OpenCV takes longer to import than other commands take to run.
    from services.cli.progress import Progress
    from studies.grasp.measure.run import see
    from studies.grasp.measure.seeds import for_method

    pictures = _pictures(video, scaled)
    color = _color(look)
    wanted = _wanted(video, subject, at, scaled, pictures)
    seeds = _seeds(at)
    if at.click:
        seeds |= _clicked(pictures, look)
    seeds = for_method(seeds, look.method)
    if not seeds:
        raise _seeds_wanted(pictures, out)
    known = _known(scaled.reference, pictures)
    plane = None if known is None else known.plane
    line = Progress("measuring", 0, progress)
    seen = see(pictures, seeds, look.method, color, line.advance, plane)
    line.end()
    findings = _findings(seen, seeds, look.method, known, wanted, pictures)
    _write(out, findings, seen)
    if overlay:
        drawing = Progress("drawing", len(seen), progress)
        _draw(out, pictures, seen, findings, wanted, drawing)
        drawing.end()
    for finger, finding in findings.items():
        typer.echo(_summary(finger, finding))
    typer.echo(f"written: {out}")


def _pictures(video: Path, scaled: ScaleOptions) -> Pictures:
    """The video, to be corrected for its lens if that is known or seen by straight edges."""
    from rhot.files.calibration import Lens, load
    from services.cli.grasp.planes import straight_of
    from studies.grasp.measure.pictures import Pictures

    if scaled.straight is None:
        lens = load(scaled.lens, Lens, "rhot calibrate lens") if scaled.lens else None
        return Pictures(video, scaled.fps, lens)
    size_px = Pictures(video, scaled.fps).first().size_px
    found = straight_of(size_px, scaled.lens, scaled.straight)
    return Pictures(video, scaled.fps, found.as_lens(), found.about)


def _findings(
    seen: list[Seen],
    seeds: Seeds,
    method: Method,
    known: Known | None,
    wanted: Wanted,
    pictures: Pictures,
) -> dict[Finger, Finding]:
    """What was seen as recordings of fingers, in the reference's plane if there is one."""
    from services.cli.grasp.measuring.in_plane import in_plane
    from studies.grasp.measure.recordings import recordings
    from studies.grasp.measure.seeds import missing_notes

    notes = missing_notes(seeds, has_base=wanted.base is not None)
    notes[""] = pictures.notes()

    def recorded(seen: list[Seen], wanted: Wanted) -> dict[Finger, Finding]:
        return recordings(seen, list(seeds), wanted, method, notes)

    return recorded(seen, wanted) if known is None else in_plane(known, seen, wanted, recorded)


def _known(reference: str | None, pictures: Pictures) -> Known | None:
    if reference is None:
        return None
    from services.cli.grasp.measuring.in_plane import reference_of

    return reference_of(reference, pictures)


def _color(look: LookOptions) -> ColorRange | None:
    from rhot.files.calibration import Colors, load
    from studies.grasp.measure.dots.color import parse_range

    if look.hsv is not None:
        return parse_range(look.hsv)
    if (look.color is None) != (look.colors is None):
        raise CaptureError("--color NAME and --colors FILE.colors.json belong together")
    if look.color is None or look.colors is None:
        return None
    known = load(look.colors, Colors, "rhot calibrate colors").colors
    if look.color not in known:
        valid = ", ".join(sorted(known)) or "none"
        raise CaptureError(f"--color {look.color}: not in {look.colors}, which has {valid}")
    return known[look.color]


def _seeds(at: SeedOptions) -> Seeds:
    from studies.grasp.measure.seeds import decode_seeds, parse_seeds

    seeds: Seeds = {}
    if at.seeds is not None:
        try:
            seeds = decode_seeds(at.seeds.read_bytes(), str(at.seeds))
        except OSError as error:
            raise CaptureError(f"{at.seeds}: cannot be read: {error.strerror}") from None
    return {**seeds, **parse_seeds(at.seed or [])}


def _clicked(pictures: Pictures, look: LookOptions) -> Seeds:
    from services.cli.grasp.measuring.click_page import as_options, clicked
    from services.pi_tracker.image.yuv_planes import bgr_image

    camera = type(pictures)(pictures.path, pictures.fps)
    seeds = clicked(bgr_image(camera.first()), look.method, typer.echo)
    typer.echo(f"the same again: {as_options(seeds)}")
    return seeds


def _seeds_wanted(pictures: Pictures, out: Path) -> CaptureError:
    """The error of a command without seeds, after showing the first picture with a grid."""
    import cv2

    from services.pi_tracker.image.yuv_planes import bgr_image
    from studies.grasp.measure.draw import with_grid

    camera = type(pictures)(pictures.path, pictures.fps)
    image = with_grid(bgr_image(camera.first()))
    out.mkdir(parents=True, exist_ok=True)
    path = out / _GRID
    if not cv2.imwrite(str(path), image):
        return CaptureError(f"no seeds, and {path} cannot be written")
    return CaptureError(
        f"no seeds: say where each joint is in the first picture. {path} shows it with a grid of "
        "pixels; then --seed index_mcp=410,352 --seed index_pip=512,300 ..., or --click on a page"
    )


def _wanted(
    video: Path, subject: str | None, at: SeedOptions, scaled: ScaleOptions, pictures: Pictures
) -> Wanted:
    from studies.grasp.measure.pictures import corrected_seeds
    from studies.grasp.measure.recordings import Wanted
    from studies.grasp.measure.scale import parse_lengths
    from studies.grasp.measure.seeds import parse_line

    base: Line | None = None
    if at.base is not None:
        ends = parse_line(at.base)
        start, end = corrected_seeds(ends, pictures.lens).values()
        base = (*start, *end)
    return Wanted(
        subject=subject or video.stem,
        source=video.name,
        base=base,
        flexion=at.flexion,
        mm_per_px=scaled.scale_mm_per_px,
        lengths_mm=parse_lengths(scaled.length or []),
    )


def _write(out: Path, findings: dict[Finger, Finding], seen: list[Seen]) -> None:
    from studies.grasp.measure.table import table
    from studies.grasp.recording import save_recording

    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
        for finger, finding in findings.items():
            save_recording(out / f"{finger}.json", finding.recording)
            (out / f"{finger}.csv").write_text(table(finding, seen))


def _draw(
    out: Path,
    pictures: Pictures,
    seen: list[Seen],
    findings: dict[Finger, Finding],
    wanted: Wanted,
    line: object,
) -> None:
    import cv2

    from services.cli.video.constant_rate import at_rate, rate_hz
    from services.cli.video.webm import WebmWriter, video_size
    from services.pi_tracker.image.yuv_planes import bgr_image
    from studies.grasp.measure.draw import drawn
    from studies.grasp.measure.recordings import with_base

    size_px = video_size(pictures.first().size_px)
    stamps_ns = [round(1e9 * one.time_s) for one in seen]
    hz = rate_hz("the video", stamps_ns)

    def shown() -> Iterator[tuple[int, Image]]:
        for number, frame in enumerate(pictures.frames()):
            place = with_base(seen[number], wanted.base)
            picture = drawn(bgr_image(frame), place, findings, number)
            line.advance()  # type: ignore[attr-defined]
            yield stamps_ns[number], cv2.resize(picture, size_px, interpolation=cv2.INTER_AREA)

    with WebmWriter(out / "overlay.webm", size_px, hz) as video:
        for picture in at_rate(shown(), hz):
            video.write(picture)


def _summary(finger: Finger, finding: Finding) -> str:
    from studies.grasp.measure.summary import summary

    return f"{finger}:\n{summary(finding)}"
