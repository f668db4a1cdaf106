"""What `rhot track` makes of two videos of another renderer, by the commands of its guide.

    RHOT_DATA=FOLDER python benchmarks/other_renderer_videos.py [--tuning] [--clip PART]
        [--drawn COUNT] [--json FILE]

Clips of benchmarks/other_renderer.py as H.264 (crf 23), the right one begun 13 pictures later.
Lenses and where the cameras stand are given; colours are proposed by `rhot calibrate colors
--auto`, `rhot track` finds the clocks, and nobody measured the hand.
    told         of tips and wrists of which a third shows in both cameras, the share told, per cent
    rms ... max  errors of those, mm
    clock        how far off the right video's clock is put right, ms
A command that fails is told in its words. --tuning: the half that constants may be chosen on, which
is no evidence. --drawn: so many clips that a number draws instead of those made by hand. Rendering
takes five minutes a clip.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import av
import numpy as np
from other_renderer import main

from rhot.files.calibration import CameraPlace, Lens, RigGeometry, save
from rhot.files.capture import read_lines
from rhot.geometry.transforms import Array
from rhot.messages import HandPoints

if TYPE_CHECKING:
    from testing.second_renderer.clip import Clip
    from testing.second_renderer.filming import Film

ROOT = Path(__file__).parents[1]
# Pictures that the right camera began later; the share of paint that both must see.
LATER, SHOWS = 13, 1.0 / 3.0
# Points have a past and a future between these, s from the beginning and from the end.
_WARM_S, _END_S = 1.0, 0.15
_COLUMNS = ("told", "rms", "median", "p95", "max", "clock")


def write_videos(clip: Clip, shots: Film, folder: Path) -> None:
    """left.mp4 and right.mp4."""
    for name, first in (("left", 0), ("right", LATER)):
        pictures = shots.pictures[name]
        height, width = pictures[0].shape
        with av.open(str(folder / f"{name}.mp4"), "w") as target:
            stream = target.add_stream("libx264", rate=round(clip.rig.fps), options={"crf": "23"})
            stream.width, stream.height, stream.pix_fmt = width, height * 2 // 3, "yuv420p"
            for number, picture in enumerate(pictures[first:]):
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="yuv420p")
                frame.pts = number
                target.mux(stream.encode(frame))
            target.mux(stream.encode(None))


def write_rig(clip: Clip, folder: Path) -> None:
    """rig.toml and calibration/, but for the colours."""
    from testing.second_renderer.paint import COLORS, LANDMARKS

    places, tables = {}, []
    for name, camera in clip.rig.cameras().items():
        lens = Lens(
            date="",
            tool="benchmarks",
            size_px=camera.size_px,
            matrix=tuple(map(tuple, camera.matrix.tolist())),  # type: ignore[arg-type]
            distortion=tuple(camera.distortion.tolist()),
        )
        save(folder / "calibration" / f"{name}.lens.json", lens)
        rows = tuple(map(tuple, camera.T_rig_from_camera.tolist()))
        places[name] = CameraPlace(T_rig_from_camera=rows)  # type: ignore[arg-type]
        readout_ms = 1e3 * clip.shutter.row_s * camera.size_px[1]
        tables.append(f'[[camera]]\nname = "{name}"\nreadout_ms = {readout_ms:.2f}\n')
    geometry = RigGeometry(date="", tool="benchmarks", cameras=places)
    save(folder / "calibration" / "rig.json", geometry)
    markers = [f'{mark} = "{color}"' for mark, color in zip(LANDMARKS, COLORS, strict=True)]
    text = "\n".join([*tables, "[hand.right.markers]", *markers, ""])
    (folder / "rig.toml").write_text(text, encoding="utf-8")


def track(folder: Path) -> str:
    """By the commands of docs/guide/videos.md; returns the last words of one that failed."""
    colors = [
        ["calibrate", "colors", name, "--video", f"{name}.mp4", "--auto", "--config", "rig.toml"]
        for name in ("left", "right")
    ]
    whole = ["track", "left=left.mp4", "right=right.mp4", "--config", "rig.toml", "--out", "result"]
    for words in (*colors, whole):
        ended = subprocess.run(
            [sys.executable, "-m", "services.cli", *words],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": f"{ROOT}:{os.environ.get('PYTHONPATH', '')}"},
            capture_output=True,
            text=True,
            check=False,
        )
        if ended.returncode:
            return (ended.stderr.strip().splitlines() or ["no word"])[-1]
    return ""


def figures_of(clip: Clip, shots: Film, result: Path) -> dict[str, float]:
    """Errors of a result's points. Stamps are since the left video's first picture."""
    from testing.second_renderer.paint import LANDMARKS

    rows = [
        (1e-9 * message.stamp_ns, message)
        for message in read_lines(result / "points.jsonl", HandPoints)
    ]
    rows = [row for row in rows if _WARM_S < row[0] < clip.seconds - _END_S]
    truth_m = _truth(clip, np.array([at_s for at_s, _ in rows]))
    errors_mm = np.full(truth_m.shape[:2], np.nan)
    for n, (_, message) in enumerate(rows):
        for point in message.points:
            if point.name in LANDMARKS:
                column = LANDMARKS.index(point.name)
                apart_m = np.array(point.position_m) - truth_m[n, column]
                errors_mm[n, column] = 1e3 * np.linalg.norm(apart_m)
    wanted = errors_mm[np.array([_shown(shots, at_s) for at_s, _ in rows]) > SHOWS]
    told = wanted[np.isfinite(wanted)]
    clocks = json.loads((result / "summary.json").read_text(encoding="utf-8"))["clocks"]
    late_s = -LATER / clip.rig.fps - clip.rig.phase_s
    return {
        "told": 100.0 * len(told) / len(wanted),
        "rms": float(np.sqrt(np.mean(told**2))),
        "median": float(np.median(told)),
        "p95": float(np.percentile(told, 95)),
        "max": float(told.max()),
        "clock": 1e3 * (clocks[0]["used_offset_s"] - late_s),
    }


def _truth(clip: Clip, times_s: Array) -> Array:
    """Middles of all paint (t, landmarks, 3), m."""
    from testing.second_renderer.paint import landmarks_at

    _, paint = clip.hand()
    bones = clip.play.bones(times_s)
    poses = zip(bones.wrist, bones.axes, bones.joints, strict=True)
    return np.array([landmarks_at(paint, *pose) for pose in poses])


def _shown(shots: Film, at_s: float) -> Array:
    """The share (landmarks,) of paint that both cameras see in the pictures about an instant."""
    shares = []
    for name, times_s in shots.times_s.items():
        after = int(np.clip(np.searchsorted(times_s, at_s), 1, len(times_s) - 1))
        shares += [shots.shares[name][after - 1], shots.shares[name][after]]
    return np.asarray(np.min(shares, axis=0))


def measure(clips: Mapping[str, Clip]) -> dict[str, dict[str, float]]:
    """Figures of all clips, printed as they come."""
    from testing.second_renderer.filming import film

    print(f"{'clip':28}" + "".join(f"{name:>9}" for name in _COLUMNS))
    results = {}
    for name, clip in clips.items():
        shots = film(clip)
        with tempfile.TemporaryDirectory() as folder:
            write_videos(clip, shots, Path(folder))
            write_rig(clip, Path(folder))
            wrong = track(Path(folder))
            if wrong:
                print(f"{name:28}{wrong}", flush=True)
                continue
            results[name] = figures_of(clip, shots, Path(folder) / "result")
        row = "".join(f"{results[name][column]:9.2f}" for column in _COLUMNS)
        print(f"{name:28}{row}", flush=True)
    return results


if __name__ == "__main__":
    sys.exit(main(measure, __doc__))
