"""A recording of `rhot record` as the folders that commands read: a capture and a result.

So `rhot plot` and `rhot score` need to know folders only. What is unpacked is gone when the command
ends; errors name the recording.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE, CaptureError, ConfigError, DiskFullError, RhotError
from rhot.files.capture import Capture
from rhot.files.config import RigConfig
from rhot.messages import HandPoints, HandPose, MarkerFrame
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.messages.simulator import Truth
from services.cli.offline.results import ResultWriter
from services.cli.offline.track_summary import CameraCounter, Summary
from services.cli.recorded_messages import arrivals

# Streams of a result, and what they hold.
_RESULT: dict[topics.Topic[Any], tuple[str, type[Any]]] = {
    topics.MARKERS: ("markers", MarkerFrame),
    topics.POINTS: ("points", HandPoints),
    topics.POSE: ("poses", HandPose),
    topics.OBJECT: ("objects", ObjectPose),
    topics.CONTACTS: ("contacts", ObjectContacts),
}


def is_recording(path: Path) -> bool:
    """Whether a path is a recording's file, not a folder."""
    return path.suffix == ".mcap" and not path.is_dir()


@contextlib.contextmanager
def unpacked(path: Path) -> Iterator[tuple[Capture, Path]]:
    """The capture and the result in a recording; a folder is both as it is.

    Raises CaptureError if the recording cannot be read.
    """
    if not is_recording(path):
        yield Capture(path), path
        return
    with tempfile.TemporaryDirectory(prefix="rhot-") as folder:
        capture, result = Capture(Path(folder) / "capture"), Path(folder) / "result"
        try:
            _unpack(path, capture, result)
            yield capture, result
        except DiskFullError:
            raise
        except RhotError as error:
            text = str(error)
            for inside in (capture.folder, result):
                text = text.replace(f"{inside}/", f"{path}: ").replace(str(inside), str(path))
            raise CaptureError(text) from None


def _unpack(path: Path, capture: Capture, result: Path) -> None:
    kinds = {topic: kind for topic, (_, kind) in _RESULT.items()}
    counters: dict[str, CameraCounter] = {}
    rig = _unpack_rig(path, capture)
    with ResultWriter(result) as writer, capture.truth.open("wb") as truth:
        for topic, message in arrivals(path, {**kinds, topics.TRUTH: Truth}):
            if topic is topics.TRUTH:
                truth.write(msgspec.json.encode(message) + b"\n")
                continue
            writer.write(_RESULT[topic][0], [message])
            if isinstance(message, MarkerFrame):
                counters.setdefault(message.camera, CameraCounter()).add(message)
        writer.finish(
            Summary(
                rig=rig,
                cameras={name: counter.summary() for name, counter in sorted(counters.items())},
                **writer.counts,
                refusals={},
                complete=True,
                warnings=[],
                notes=[],
                clocks=msgspec.UNSET,
            )
        )
    if capture.truth.stat().st_size == 0:
        capture.truth.unlink()


def _unpack_rig(path: Path, capture: Capture) -> str:
    """rig.toml and calibration that the recorder kept; the rig's name."""
    # Not above: the package mcap and the simulator's files are not needed for folders.
    from services.recorder.reader import read_attachments
    from services.simulator.files.rig_toml import rig_toml

    kept = read_attachments(path)
    try:
        config = msgspec.json.decode(kept["config.json"], type=RigConfig)
    except KeyError:
        raise CaptureError(f"{path}: holds no config.json: it is no recording of a rig") from None
    except UNDECODABLE as error:
        raise CaptureError(f"{path}: its config.json is damaged: {error}") from None
    config = msgspec.structs.replace(
        config, rig=msgspec.structs.replace(config.rig, calibration="calibration")
    )
    (capture.folder / "calibration").mkdir(parents=True)
    for name, data in kept.items():
        folder, _, file = name.partition("/")
        # Names come from a file that anybody may have written.
        if folder == "calibration" and file == Path(file).name and file.endswith(".json"):
            (capture.folder / "calibration" / file).write_bytes(data)
    try:
        text = rig_toml(config, f"from {path.name}")
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{path}: its configuration cannot be written: {error}") from None
    capture.rig_toml.write_text(text, encoding="utf-8")
    return config.rig.name
