"""What frames that show the picture before them once more cost, and whether they are found.

    RHOT_DATA=FOLDER python benchmarks/duplicate_frames.py [--clips N] [--json FILE]

Simulated hands, two scenes and two recordings of a Leap sensor's, none of them what the constants
were chosen on. In both cameras 12 % of the pictures are replaced by the one before, and the videos
are encoded anew. By `rhot track`'s own steps: 3D points' RMS and largest error (mm) of the video
without any (`none`), of that with them left out as the command does (`left out`), and with all
taken as they are (`taken`); how many are found, and how many pictures are left out wrongly.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import av
import numpy as np

from rhot.files.capture import Capture, read_lines
from rhot.files.config import load_rig
from rhot.messages import MarkerFrame
from services.cli.defaults import sim_toml
from services.cli.evaluate.score_result import score_result
from services.cli.offline import run
from services.cli.offline.frames.duplicate_frames import DuplicateFrames
from services.cli.offline.inputs import job_of
from services.cli.offline.simulate_motion import MotionRequest, write_motion
from services.pi_tracker.image.frame import Frame, Image
from services.simulator.files.capture_writer import write_capture
from services.simulator.scene.scene import load_scene

DATA = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
SCENES, RECORDINGS = ("fist", "pinch"), ("grab.csv", "HandSplay-110fps.csv")
SECONDS, SHARE = 4.0, 0.12
# FFmpeg's name of an encoder, and its options.
ENCODERS: dict[str, tuple[str, dict[str, str]]] = {
    "H.264, crf 23": ("libx264", {"crf": "23"}),
    "H.264, crf 28": ("libx264", {"crf": "28"}),
    "JPEG": ("mjpeg", {"qmin": "3", "qmax": "3"}),
}
Figures = dict[str, float]


class AllFrames(DuplicateFrames):
    """Leaves none out."""

    def new_frames(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """All of them."""
        yield from frames


def clips(folder: Path) -> Iterator[tuple[str, Path]]:
    """Name and capture of each, rendered."""
    rig = load_rig(sim_toml())
    for name in SCENES:
        write_capture(load_scene(rig, name, 1), SECONDS, folder / name)
        yield name, folder / name
    for file in RECORDINGS:
        path = DATA / "hand_motion" / "leap" / file
        if not path.is_file():
            print(f"no {path}; set RHOT_DATA to the folder of real recordings")
            continue
        request = MotionRequest(path, SECONDS, 0.5, 1.0, 1)
        write_motion(rig, request, folder / path.stem, lambda *_: None)
        yield f"Leap {path.stem}", folder / path.stem


def encoded(capture: Path, out: Path, encoder: str, planted: Mapping[str, set[int]]) -> Path:
    """A copy of a capture with its videos encoded anew, and duplicates by number and camera."""
    shutil.copytree(capture, out)
    codec, options = ENCODERS[encoder]
    for camera, numbers in planted.items():
        last: Image | None = None
        with (
            av.open(str(capture / f"{camera}.mkv")) as source,
            av.open(str(out / f"{camera}.mkv"), "w") as target,
        ):
            stream = target.add_stream(codec, rate=30, options=options)
            shape = source.streams.video[0]
            stream.width, stream.height = shape.width, shape.height
            stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
            for number, shown in enumerate(source.decode(video=0)):
                image = shown.reformat(format="yuv420p").to_ndarray()
                last = image if last is None or number not in numbers else last
                frame = av.VideoFrame.from_ndarray(last, format="yuv420p")
                frame.pts = number
                target.mux(stream.encode(frame.reformat(format=stream.pix_fmt)))
            target.mux(stream.encode(None))
    return out


def points_of(capture: Path, out: Path) -> Figures:
    """RMS and largest error of a capture's points by `rhot track`, mm."""
    run.run(job_of([str(capture)], None), out)
    errors = [
        point.error
        for hand in score_result(Capture(capture), out, stages=True).stages.values()
        for point in hand.points.values()
    ]
    rms = float(np.sqrt(np.mean([error.total_rms_mm**2 for error in errors])))
    return {"rms": rms, "max": max(error.max_mm for error in errors)}


def of_clip(capture: Path, encoder: str, folder: Path) -> Figures:
    """All figures of one clip through one encoder."""
    rng = np.random.default_rng(3)
    planted: dict[str, set[int]] = {}
    for camera in ("left", "right"):
        with av.open(str(capture / f"{camera}.mkv")) as video:
            count = sum(1 for _ in video.decode(video=0))
        chosen = np.flatnonzero(rng.random(count) < SHARE)
        planted[camera] = {int(n) for n in chosen if 2 < n < count - 1}
    figures: Figures = {}
    none = encoded(capture, folder / "none", encoder, {name: set() for name in planted})
    filled = encoded(capture, folder / "filled", encoder, planted)
    for way, source, frames in (
        ("none", none, DuplicateFrames),
        ("left", filled, DuplicateFrames),
        ("taken", filled, AllFrames),
    ):
        run.DuplicateFrames = frames
        figures |= {
            f"{key}_{way}": v for key, v in points_of(source, folder / f"out_{way}").items()
        }
        gone = missing(source, folder / f"out_{way}")
        if way == "none":
            figures["wrong"] = sum(map(len, gone.values()))
        elif way == "left":
            figures["planted"] = sum(map(len, planted.values()))
            figures["found"] = sum(len(planted[name] & gone[name]) for name in planted)
            figures["wrong"] += sum(len(gone[name] - planted[name]) for name in planted)
    run.DuplicateFrames = DuplicateFrames
    return {key: round(value, 3) for key, value in figures.items()}


def missing(capture: Path, result: Path) -> dict[str, set[int]]:
    """The numbers of the pictures without markers' message, by camera."""
    kept: dict[str, set[int]] = {}
    for frame in read_lines(result / "markers.jsonl", MarkerFrame):
        kept.setdefault(frame.camera, set()).add(frame.seq)
    return {
        one.camera: {frame.seq for frame in one.frames()} - kept[one.camera]
        for one in job_of([str(capture)], None).inputs
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", type=int, default=None, help="only so many of them")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    found: dict[str, Figures] = {}
    print(f"{'':34s}{'found':>9s}{'wrong':>7s}   RMS, max: none   left out      taken")
    with tempfile.TemporaryDirectory() as folder:
        for name, capture in list(clips(Path(folder)))[: args.clips]:
            for number, encoder in enumerate(ENCODERS):
                place = capture.with_name(f"{capture.name}-{number}")
                place.mkdir()
                f = found[f"{name}; {encoder}"] = of_clip(capture, encoder, place)
                print(
                    f"{name + '; ' + encoder:34s}{f['found']:4.0f}/{f['planted']:<4.0f}"
                    f"{f['wrong']:7.0f}   {f['rms_none']:7.2f}{f['max_none']:6.1f}"
                    f"{f['rms_left']:7.2f}{f['max_left']:6.1f}{f['rms_taken']:7.2f}"
                    f"{f['max_taken']:6.1f}",
                    flush=True,
                )
    figures = {"clips": found, "encoders": {}}
    for encoder in ENCODERS:
        of_it = {name: f for name, f in found.items() if name.endswith(f"; {encoder}")}
        figures["encoders"][encoder] = summed(of_it)
        print(encoder, figures["encoders"][encoder])
    if args.json:
        args.json.write_text(json.dumps(figures, indent=1) + "\n")


def summed(found: Mapping[str, Figures]) -> Figures:
    """Counts added, RMS errors' geometric means, the largest of the largest."""
    counts = ("planted", "found", "wrong")
    total = {key: sum(one[key] for one in found.values()) for key in counts}
    for way in ("none", "left", "taken"):
        logs = [np.log(one[f"rms_{way}"]) for one in found.values()]
        total[f"rms_{way}"] = round(float(np.exp(np.mean(logs))), 3)
        total[f"max_{way}"] = max(one[f"max_{way}"] for one in found.values())
    return total


if __name__ == "__main__":
    main()
