"""Where a recording's chunks are, kept in a file until the recording is finished.

MCAP's index of chunks stands at the end of a file, and mcap keeps it in memory until then: 1 to 2
kB a chunk of 20 streams, 10 MB an hour with two chunks a second. A recorder runs for weeks.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgspec
from mcap.records import ChunkIndex

_LENGTH_BYTES = 4


class ChunkSpool:
    """Takes the place of mcap's list: what is appended, in its order. The file has no name, so
    nothing is left of it if the recorder is killed.
    """

    def __init__(self, folder: Path) -> None:
        """Raises OSError where no file can be made."""
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - closed with the recording
        self._encoder = msgspec.msgpack.Encoder()
        self._decoder = msgspec.msgpack.Decoder(ChunkIndex)

    def append(self, index: ChunkIndex) -> None:
        """Keep one more; raises OSError on a full disk."""
        data = self._encoder.encode(index)
        self._file.write(len(data).to_bytes(_LENGTH_BYTES, "little") + data)

    def __iter__(self) -> Iterator[ChunkIndex]:
        self._file.seek(0)
        while length := self._file.read(_LENGTH_BYTES):
            yield self._decoder.decode(self._file.read(int.from_bytes(length, "little")))

    def close(self) -> None:
        """Forget them all."""
        self._file.close()
