"""The files of `rhot export`: CSV by the standard library, Parquet by pyarrow.

Both are opened by pandas, R, MATLAB and the like as they are.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from services.cli.export.tables import Row, Table

if TYPE_CHECKING:
    import pyarrow as pa


class TableWriter(Protocol):
    """One table's file."""

    def write(self, rows: Sequence[Row]) -> None: ...

    def close(self) -> None: ...


class CsvWriter:
    """Comma-separated, a header line, empty cells where nothing is known."""

    def __init__(self, table: Table, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._csv = csv.writer(self._file, lineterminator="\n")
        self._csv.writerow([name for name, _ in table.columns])

    def write(self, rows: Sequence[Row]) -> None:
        self._csv.writerows(rows)

    def close(self) -> None:
        self._file.close()


class ParquetWriter:
    """Apache Parquet, compressed; columns keep their types, unknown cells are null."""

    def __init__(self, table: Table, path: Path) -> None:
        # Not above: of the extra `tables`, for those who want it.
        import pyarrow
        import pyarrow.parquet

        kinds: dict[type[Any], pa.DataType] = {
            float: pyarrow.float64(),
            int: pyarrow.int64(),
            bool: pyarrow.bool_(),
            str: pyarrow.string(),
        }
        self._schema = pyarrow.schema([(name, kinds[kind]) for name, kind in table.columns])
        self._writer = pyarrow.parquet.ParquetWriter(path, self._schema, compression="zstd")

    def write(self, rows: Sequence[Row]) -> None:
        import pyarrow

        if rows:
            arrays = [
                pyarrow.array(cells, field.type)
                for cells, field in zip(zip(*rows, strict=True), self._schema, strict=True)
            ]
            self._writer.write_batch(pyarrow.record_batch(arrays, schema=self._schema))

    def close(self) -> None:
        self._writer.close()


WRITERS: dict[str, type[CsvWriter] | type[ParquetWriter]] = {
    "csv": CsvWriter,
    "parquet": ParquetWriter,
}
