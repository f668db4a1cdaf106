"""A recording into flat tables: read once, every table written beside the others.

Files are written as NAME.partial and named when all are complete, so that a run that fails or is
interrupted leaves what was there before; the next one replaces what it left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE, CaptureError, RhotError, disk_full
from rhot.files.capture import read_lines
from services.cli.export.tables import TABLES, Row, Table
from services.cli.export.writers import WRITERS, TableWriter
from services.cli.offline.results import PARTIAL, SUMMARY, check_result
from services.cli.progress import Progress
from services.cli.recorded.messages import arrivals

# Rows of a table that are gathered before they are written.
_BATCH = 10_000


def export(
    recording: Path,
    out: Path,
    formats: Sequence[str],
    names: Sequence[str] = (),
    progress: bool | None = False,
) -> dict[Path, int]:
    """Write tables of a recording into a folder; rows by file, empty tables left out.

    recording: a result folder of `rhot track` or a file of `rhot record`; formats of WRITERS; names
    of the tables, all by default. Raises RhotError.
    """
    tables = [table for table in TABLES if not names or table.name in names]
    shown = Progress("rhot export:", _count(recording), progress, unit="messages")
    messages = (
        arrivals(recording, {table.topic: table.kind for table in tables})
        if recording.is_file()
        else _folder(recording, tables)
    )
    first = next(messages, None)
    if first is None:
        raise CaptureError(f"{recording}: holds no markers, points, poses or objects to export")
    origin_ns = first[1].stamp_ns
    try:
        out.mkdir(parents=True, exist_ok=True)
        with _Files(out, tables, formats) as files:
            for topic, message in chain([first], messages):
                files.add(topic, message, origin_ns)
                shown.advance()
            return files.finish()
    except OSError as error:
        raise disk_full(error, out) or CaptureError(f"{out}: cannot be written: {error}") from None
    finally:
        shown.end()


class _Files:
    """The open files of a run, by table and format."""

    def __init__(self, out: Path, tables: Sequence[Table], formats: Sequence[str]) -> None:
        self._out, self._tables, self._formats = out, tables, formats
        self._rows: dict[str, list[Row]] = {table.name: [] for table in tables}
        self._counts = dict.fromkeys(self._rows, 0)
        self._writers: dict[tuple[str, str], TableWriter] = {}
        self._stack = ExitStack()

    def __enter__(self) -> _Files:
        for table in self._tables:
            for form in self._formats:
                writer = WRITERS[form](table, self._partial(table.name, form))
                self._stack.callback(writer.close)
                self._writers[table.name, form] = writer
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self._stack.close()
        for name, form in self._writers:
            self._partial(name, form).unlink(missing_ok=True)

    def add(self, topic: topics.Topic[Any], message: Any, origin_ns: int) -> None:
        """A message into all tables of its topic."""
        for table in self._tables:
            if table.topic is topic:
                rows = self._rows[table.name]
                rows.extend(table.rows(message, origin_ns))
                if len(rows) >= _BATCH:
                    self._write(table.name)

    def finish(self) -> dict[Path, int]:
        """Name what holds anything; old tables that hold nothing now are removed."""
        for name in self._rows:
            self._write(name)
        self._stack.close()
        written = {}
        for name, form in self._writers:
            path = self._out / f"{name}.{form}"
            if self._counts[name]:
                self._partial(name, form).replace(path)
                written[path] = self._counts[name]
            else:
                path.unlink(missing_ok=True)
        return written

    def _write(self, name: str) -> None:
        rows = self._rows[name]
        self._counts[name] += len(rows)
        for form in self._formats:
            self._writers[name, form].write(rows)
        rows.clear()

    def _partial(self, name: str, form: str) -> Path:
        return self._out / f"{name}.{form}{PARTIAL}"


def _folder(result: Path, tables: Sequence[Table]) -> Iterator[tuple[topics.Topic[Any], Any]]:
    """A result's messages, stream after stream; markers first, as they are the earliest."""
    check_result(result)
    for stream in dict.fromkeys(table.stream for table in tables):
        table = next(table for table in tables if table.stream == stream)
        path = result / f"{stream}.jsonl"
        if path.is_file():
            for message in read_lines(path, table.kind):
                yield table.topic, message


def _count(recording: Path) -> int:
    """Messages to expect, for the progress only; what is wrong is told when it is read."""
    try:
        if recording.is_file():
            from services.recorder.reader import summarize

            return summarize(recording).messages
        counts = msgspec.json.decode((recording / SUMMARY).read_bytes())
        return sum(counts[name] for name in ("markers", "points", "poses", "objects", "contacts"))
    except (RhotError, OSError, *UNDECODABLE, KeyError, TypeError):
        return 0
