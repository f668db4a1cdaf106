"""Our reading of chunks, beside mcap's own."""

from __future__ import annotations

import random
from pathlib import Path

from mcap.reader import make_reader

from rhot import topics
from services.recorder.reader import read
from services.recorder.writer import RecordingWriter

KEY = "rhot/desk/hand/left/pose"


def test_the_same_messages_in_the_same_order_as_mcaps_reader(tmp_path: Path) -> None:
    """Times that repeat, go back, and chunks that overlap."""
    chance = random.Random(3)
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        for number in range(1500):
            at_ns = number // 3 * 1_000_000 + chance.randrange(400) * 1_000_000
            payload = b"%d %s" % (number, chance.randbytes(chance.randrange(400)))
            writer.add(topics.POSE, KEY, payload, at_ns)
            if number % 500 == 499:
                writer.flush()
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert len(summary.chunk_indexes) >= 5
        theirs = [(m.log_time, m.data) for _, _, m in reader.iter_messages()]
    assert [(r.log_time_ns, r.payload) for r in read(tmp_path / "a.mcap")] == theirs
    some = [(r.log_time_ns, r.payload) for r in read(tmp_path / "a.mcap", 300_000_000, 500_000_000)]
    assert some == [one for one in theirs if 300_000_000 <= one[0] <= 500_000_000]
    assert some


def test_only_the_chunks_that_are_wanted_are_read(tmp_path: Path) -> None:
    """Damage before the window does no harm."""
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        for second in range(10):
            writer.add(topics.POSE, KEY, b"%d" % second * 100, second * 10**9)
            writer.flush()
    path = tmp_path / "a.mcap"
    data = bytearray(path.read_bytes())
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        first = summary.chunk_indexes[0]
    data[first.chunk_start_offset + first.chunk_length - 3] ^= 0xFF
    path.write_bytes(data)
    assert [r.log_time_ns for r in read(path, 8 * 10**9)] == [8 * 10**9, 9 * 10**9]
