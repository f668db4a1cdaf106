"""The folder `rhot track` writes: .jsonl files in wire format, clocks.json of two cameras or more,
and summary.json last of all.

Each file is written as NAME.partial and gets its name when all are complete. A run that fails or
is interrupted removes its .partial files and leaves what was there before; one that is killed, or a
bug, leaves them, and readers refuse such a folder until the next run replaces it. A folder that
holds anything else is refused too, so that nobody's files are lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self, TypeVar

import msgspec

from rhot.errors import CaptureError, RhotError, disk_full, writing
from rhot.files.capture import read_lines
from services.cli.offline.clocks.camera_clock import CameraClock
from services.cli.offline.track_summary import Summary

M = TypeVar("M", bound=msgspec.Struct)

STREAMS = ("markers", "points", "poses", "objects", "contacts")
SUMMARY, CLOCKS = "summary.json", "clocks.json"
PARTIAL = ".partial"
_OWN = {f"{name}.jsonl" for name in STREAMS} | {SUMMARY, CLOCKS}
# What `rhot plot` and `rhot export` write beside them: a second run may overwrite a folder that
# holds pictures and tables of the first.
ADDED = (".png", ".csv", ".parquet", ".bvh", ".trc", ".mot", ".glb", ".webm")


class ResultWriter:
    """Context manager: open files to write messages to, named for good on `finish`."""

    def __init__(self, folder: Path) -> None:
        """Raises CaptureError if the folder cannot be made or holds foreign files."""
        self.folder = folder
        self.counts = dict.fromkeys(STREAMS, 0)
        self._files: dict[str, BinaryIO] = {}
        self._stack = ExitStack()
        _prepare(folder)

    def __enter__(self) -> Self:
        try:
            for name in STREAMS:
                path = self.folder / f"{name}.jsonl{PARTIAL}"
                self._files[name] = self._stack.enter_context(path.open("wb"))
        except BaseException as error:
            # Whoever is not let in is not shown out.
            self.__exit__(type(error), error, error.__traceback__)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        failed = error if isinstance(error, RhotError) else _no_space(error, self.folder)
        try:
            self._stack.close()
        except OSError as unwritten:
            # What was still in the buffers did not fit either; the first failure is the one told.
            failed = failed or _no_space(unwritten, self.folder)
            if failed is None and error is None:
                raise
        if failed is not None or isinstance(error, KeyboardInterrupt):
            for path in self.folder.glob(f"*{PARTIAL}"):
                path.unlink()
            if not any(self.folder.iterdir()):
                self.folder.rmdir()
        if failed is not None and failed is not error:
            raise failed from None

    def write(self, stream: str, messages: Iterable[msgspec.Struct]) -> None:
        """Append messages, one a line. Raises DiskFullError."""
        with writing(self.folder):
            for message in messages:
                self._files[stream].write(msgspec.json.encode(message) + b"\n")
                self.counts[stream] += 1

    def written(self, stream: str, kind: type[M]) -> Iterator[M]:
        """What was written to a stream so far, read back one by one."""
        with writing(self.folder):
            self._files[stream].flush()
        return read_lines(self.folder / f"{stream}.jsonl{PARTIAL}", kind)

    def finish(self, summary: Summary, clocks: Sequence[CameraClock] = ()) -> None:
        """Give the files their names, write clocks.json if there is one, and summary.json."""
        self._stack.close()
        # Without its summary a result counts as incomplete, so that old and new files are never
        # taken for one.
        (self.folder / SUMMARY).unlink(missing_ok=True)
        for name in STREAMS:
            (self.folder / f"{name}.jsonl{PARTIAL}").replace(self.folder / f"{name}.jsonl")
        if clocks:
            self._write_json(CLOCKS, clocks)
        else:
            (self.folder / CLOCKS).unlink(missing_ok=True)
        self._write_json(SUMMARY, summary)

    def _write_json(self, name: str, content: Any) -> None:
        partial = self.folder / f"{name}{PARTIAL}"
        with writing(self.folder):
            partial.write_bytes(msgspec.json.format(msgspec.json.encode(content), indent=1) + b"\n")
        partial.replace(self.folder / name)


def _no_space(error: BaseException | None, folder: Path) -> RhotError | None:
    return None if error is None else disk_full(error, folder)


def check_result(folder: Path, *streams: str) -> None:
    """Raises CaptureError unless the folder holds a complete result with these streams."""
    make_it = f"`rhot track CAPTURE --out {folder}`"
    if not folder.is_dir():
        raise CaptureError(f"{folder}: no such folder; make it with {make_it}")
    # Those of tables and videos that were not finished do not matter.
    if any(path.removesuffix(PARTIAL) in _OWN for path in _partials(folder)):
        raise CaptureError(
            f"{folder}: holds {PARTIAL} files of a run that was interrupted; "
            "run `rhot track` into it again"
        )
    if not (folder / SUMMARY).is_file():
        raise CaptureError(
            f"{folder}: has no {SUMMARY}, so it is no complete result; make one with {make_it}"
        )
    for stream in streams:
        if not (folder / f"{stream}.jsonl").is_file():
            raise CaptureError(f"{folder}: has no {stream}.jsonl; make it with {make_it}")


def _partials(folder: Path) -> list[str]:
    return [path.name for path in folder.glob(f"*{PARTIAL}")]


def _prepare(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        present = sorted(path.name for path in folder.iterdir())
        foreign = [
            name
            for name in present
            if name.removesuffix(PARTIAL) not in _OWN
            and not name.removesuffix(PARTIAL).endswith(ADDED)
        ]
        if foreign:
            raise CaptureError(
                f"{folder}: holds files that are not a result of `rhot track` "
                f"({', '.join(foreign[:3])}); give --out another folder"
            )
    except OSError as error:
        raise CaptureError(f"{folder}: cannot be written: {error}") from None
