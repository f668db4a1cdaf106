"""What the spool keeps of chunks is what comes out, and a recording's index is made of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import ChunkIndex

from rhot import topics
from services.recorder.chunk_spool import ChunkSpool
from services.recorder.writer import CHUNK_NS, RecordingWriter

START_NS = 1_760_000_000_000_000_000


def chunk(number: int) -> ChunkIndex:
    return ChunkIndex(
        message_start_time=START_NS + number,
        message_end_time=2**63 + number,
        chunk_start_offset=number * 1000,
        chunk_length=999,
        message_index_offsets={1: number, 65_535: 2**40},
        message_index_length=number,
        compression="zstd",
        compressed_size=900,
        uncompressed_size=5000,
    )


def test_what_is_kept_comes_out_in_order_and_no_file_is_seen(tmp_path: Path) -> None:
    spool = ChunkSpool(tmp_path)
    for number in range(300):
        spool.append(chunk(number))
    assert list(spool) == [chunk(number) for number in range(300)]
    assert list(spool) == [chunk(number) for number in range(300)]
    assert list(tmp_path.iterdir()) == []
    spool.close()
    with pytest.raises(ValueError, match="closed"):
        spool.append(chunk(0))


def test_the_index_of_a_recording_is_made_of_the_spool(tmp_path: Path) -> None:
    path = tmp_path / "long.mcap"
    key = topics.HEALTH.key("desk", service="fusion", instance="main")
    with RecordingWriter(path, "desk") as writer:
        for number in range(40):
            writer.add(topics.HEALTH, key, b"{}", START_NS + number * CHUNK_NS)
        # The last chunk is still open.
        assert len(list(writer.chunks)) == 39
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert [one.message_start_time for one in summary.chunk_indexes] == [
        START_NS + number * CHUNK_NS for number in range(40)
    ]
