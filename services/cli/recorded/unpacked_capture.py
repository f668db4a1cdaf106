"""A recording of `rhot record` as a capture: its rig, its markers, and the poses of its trackers.

What is unpacked is gone when the command ends; errors name the recording.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE, CaptureError, ConfigError, DiskFullError, RhotError, writing
from rhot.files.capture import Capture
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.messages import MarkerFrame
from rhot.messages.objects import OpenVrPose
from services.cli.recorded.messages import arrivals

# Folders of a capture that a recording keeps, and which files are in them.
_FOLDERS = {"calibration": (".json",), "meshes": (".glb", ".stl")}
# What a capture without pictures is made of.
_STREAMS: dict[topics.Topic[Any], type[Any]] = {
    topics.MARKERS: MarkerFrame,
    topics.OPENVR: OpenVrPose,
}


def is_recording(path: Path) -> bool:
    """Whether a path is a recording's file, not a folder."""
    return path.suffix == ".mcap" and not path.is_dir()


def folder_beside(result: Path, out: Path | None) -> Path:
    """Where what is made of a result goes: --out, else DIR, or a folder of FILE's name."""
    return out or (result.with_suffix("") if is_recording(result) else result)


@contextlib.contextmanager
def readable(sources: Sequence[str]) -> Iterator[list[str]]:
    """What `rhot track` is to read; a single recording becomes a capture folder of its markers.

    Raises CaptureError if the recording cannot be read or holds no markers.
    """
    if len(sources) != 1 or not is_recording(Path(sources[0])):
        yield list(sources)
        return
    path = Path(sources[0])
    with unpacking(path) as folder:
        capture = Capture(folder / "capture")
        unpack_rig(path, capture)
        _unpack_streams(path, capture)
        yield [str(capture.folder)]


def _unpack_streams(path: Path, capture: Capture) -> None:
    """markers.jsonl in the order of arrival, and objects.jsonl where there are trackers."""
    counts = dict.fromkeys(_STREAMS, 0)
    with (
        writing(capture.folder),
        capture.markers.open("wb") as markers,
        capture.objects.open("wb") as objects,
    ):
        files = {topics.MARKERS: markers, topics.OPENVR: objects}
        for topic, message in arrivals(path, _STREAMS):
            files[topic].write(msgspec.json.encode(message) + b"\n")
            counts[topic] += 1
    if not counts[topics.MARKERS]:
        raise CaptureError(f"{path}: holds no markers; record while the cameras' trackers run")
    if not counts[topics.OPENVR]:
        capture.objects.unlink()


@contextlib.contextmanager
def unpacking(path: Path) -> Iterator[Path]:
    """A folder to unpack a recording into; errors that name what is in it name the recording."""
    with tempfile.TemporaryDirectory(prefix="rhot-") as folder:
        try:
            yield Path(folder)
        except DiskFullError:
            raise
        except RhotError as error:
            text = str(error)
            for inside in (Path(folder) / "capture", Path(folder) / "result"):
                text = text.replace(f"{inside}/", f"{path}: ").replace(str(inside), str(path))
            raise type(error)(text) from None


def unpack_rig(path: Path, capture: Capture) -> str:
    """rig.toml, calibration and meshes that the recorder kept; the rig's name."""
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
    _unpack_files(kept, capture.folder)
    config = msgspec.structs.replace(
        config,
        rig=msgspec.structs.replace(config.rig, calibration="calibration"),
        object=[_with_own_mesh(table, kept) for table in config.object],
    )
    try:
        text = rig_toml(config, f"from {path.name}")
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{path}: its configuration cannot be written: {error}") from None
    capture.rig_toml.write_text(text, encoding="utf-8")
    return config.rig.name


def _unpack_files(kept: Mapping[str, bytes], where: Path) -> None:
    for folder, endings in _FOLDERS.items():
        (where / folder).mkdir(parents=True)
        for name, data in kept.items():
            inside, _, file = name.partition("/")
            # Names come from a file that anybody may have written.
            if inside == folder and file == Path(file).name and file.endswith(endings):
                (where / folder / file).write_bytes(data)


def _with_own_mesh(table: ObjectTable, kept: Mapping[str, bytes]) -> ObjectTable:
    """The table with its mesh where it was unpacked; as it is where none was kept."""
    name = f"meshes/{table.name}{Path(table.mesh).suffix.lower()}"
    return msgspec.structs.replace(table, mesh=name) if table.mesh and name in kept else table
