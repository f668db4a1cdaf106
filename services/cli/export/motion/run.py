"""A recording's hands into files of motion: one file a hand and format."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rhot import topics
from rhot.errors import CaptureError, disk_full
from rhot.files.capture import read_lines
from rhot.messages import HandPose
from services.cli.export.motion.bvh import bvh_lines
from services.cli.export.motion.clip import Clip, clips
from services.cli.export.motion.gltf import gltf_file
from services.cli.export.motion.opensim import mot_lines, trc_lines
from services.cli.offline.results import PARTIAL, check_result
from services.cli.recorded.messages import arrivals


def _text(lines: Callable[[Clip], Iterator[str]]) -> Callable[[Clip], bytes]:
    return lambda clip: ("\n".join(lines(clip)) + "\n").encode()


# What each format makes of a clip, and what its files are called.
FORMATS: dict[str, tuple[str, Callable[[Clip], bytes]]] = {
    "bvh": (".bvh", _text(bvh_lines)),
    "trc": (".trc", _text(trc_lines)),
    "mot": (".mot", _text(mot_lines)),
    "gltf": (".glb", gltf_file),
}


def export_motion(recording: Path, out: Path, formats: Sequence[str], up: str) -> dict[Path, Clip]:
    """Write each hand of a recording into out in each of FORMATS; what each file holds.

    up is a key of rhot.geometry.up_axes.UPS. Raises RhotError.
    """
    poses = _poses(recording)
    first = next(poses, None)
    if first is None:
        raise CaptureError(f"{recording}: holds no poses of a hand")
    try:
        found = clips([first, *poses], up, first.stamp_ns)
    except CaptureError as error:
        raise CaptureError(f"{recording}: {error}") from None
    written = {}
    try:
        out.mkdir(parents=True, exist_ok=True)
        for clip in found:
            for form in formats:
                suffix, encode = FORMATS[form]
                path = out / f"{clip.hand}_hand{suffix}"
                partial = path.with_name(path.name + PARTIAL)
                partial.write_bytes(encode(clip))
                partial.replace(path)
                written[path] = clip
    except OSError as error:
        raise disk_full(error, out) or CaptureError(f"{out}: cannot be written: {error}") from None
    return written


def _poses(recording: Path) -> Iterator[HandPose]:
    if recording.is_file():
        yield from (message for _, message in arrivals(recording, {topics.POSE: HandPose}))
        return
    check_result(recording)
    path = recording / "poses.jsonl"
    if path.is_file():
        yield from read_lines(path, HandPose)
