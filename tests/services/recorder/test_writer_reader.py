"""What is written is what is read, and files that are none are refused with a reason."""

from __future__ import annotations

import fcntl
import io
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import IO, Any

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from rhot import topics
from rhot.errors import CaptureError
from services.recorder import writer as writer_module
from services.recorder.reader import is_finished, read, read_attachments, summarize
from services.recorder.writer import MAX_CHANNELS, RecordingWriter

Write = Callable[..., Path]
Payload = Callable[[int], bytes]


def test_round_trip(tmp_path: Path, write: Write, payload: Payload, start_ns: int) -> None:
    records = list(read(write(tmp_path / "a.mcap")))
    assert [r.payload for r in records] == [payload(seq) for seq in range(1000)]
    assert [r.log_time_ns for r in records] == [start_ns + seq * 10_000_000 for seq in range(1000)]
    assert {r.key for r in records} == {
        "rhot/desk/camera/left/markers",
        "rhot/desk/camera/right/markers",
    }
    assert {r.encoding for r in records} == {"application/json;rhot.MarkerFrame.1"}


def test_summary_and_attachments(tmp_path: Path, write: Write) -> None:
    path = write(tmp_path / "a.mcap", 101)
    summary = summarize(path)
    assert (summary.rig, summary.messages, summary.duration_s) == ("desk", 101, 1.0)
    assert summary.keys == {
        "rhot/desk/camera/left/markers": 51,
        "rhot/desk/camera/right/markers": 50,
    }
    assert read_attachments(path) == {"config.json": b'{"rig": 1}'}


def test_other_mcap_tools_find_compressed_chunks_and_schemas(tmp_path: Path, write: Write) -> None:
    with write(tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
        assert len(summary.chunk_indexes) > 2
        schema, channel, _ = next(reader.iter_messages())
        assert schema is not None
        assert (schema.name, schema.encoding, channel.message_encoding) == (
            "rhot.MarkerFrame",
            "jsonschema",
            "json",
        )
        assert json.loads(schema.data)["type"] == "object"


@pytest.mark.parametrize(
    "missing", [{CompressionType.ZSTD}, {CompressionType.ZSTD, CompressionType.LZ4}]
)
def test_without_zstandard(
    tmp_path: Path, write: Write, monkeypatch: pytest.MonkeyPatch, missing: set[CompressionType]
) -> None:
    def refusing(output: object, chunk_size: int, compression: CompressionType) -> Writer:
        if compression in missing:
            raise writer_module.UnsupportedCompressionError(compression.name)
        return Writer(output, chunk_size, compression)  # type: ignore[arg-type]

    monkeypatch.setattr(writer_module, "Writer", refusing)
    assert len(list(read(write(tmp_path / "a.mcap")))) == 1000


def test_payloads_that_do_not_decode_are_kept(tmp_path: Path) -> None:
    rubbish = [b"", b"\xff\x00", b"{", b"x" * 65536]
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        for number, data in enumerate(rubbish):
            writer.add(
                topics.POSE,
                "rhot/desk/hand/\udcff/pose".encode("utf-8", "replace").decode(),
                data,
                number,
            )
    assert [r.payload for r in read(tmp_path / "a.mcap")] == rubbish


def test_messages_out_of_order_are_read_in_order(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        for time in (5, 3, 4, 0, 2**63):
            writer.add(topics.POSE, "rhot/desk/hand/left/pose", str(time).encode(), time)
    assert [r.log_time_ns for r in read(tmp_path / "a.mcap")] == [0, 3, 4, 5, 2**63]


def test_keys_are_bounded(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        for number in range(MAX_CHANNELS + 10):
            writer.add(topics.OPENVR, f"rhot/desk/openvr/{number}/pose", b"{}", number)
    assert (writer.messages, writer.refused) == (MAX_CHANNELS, 10)


def test_an_empty_recording_is_whole(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.mcap", "desk"):
        pass
    assert list(read(tmp_path / "a.mcap")) == []
    assert summarize(tmp_path / "a.mcap").messages == 0


def test_the_file_is_locked_while_it_is_written(tmp_path: Path) -> None:
    with (
        RecordingWriter(tmp_path / "a.mcap", "desk"),
        (tmp_path / "a.mcap").open("rb") as file,
        pytest.raises(BlockingIOError),
    ):
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)


def foreign(path: Path) -> None:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        writer.finish()


BAD = {
    "missing": (lambda _: None, "cannot be read"),
    "empty": (lambda path: path.write_bytes(b""), "no MCAP file"),
    "text": (lambda path: path.write_text("hello " * 100), "no MCAP file"),
    "foreign": (foreign, "no recording of rhot"),
    "only magic": (lambda path: path.write_bytes(b"\x89MCAP0\r\n" * 2), "cut off"),
    "magic and rubbish": (
        lambda path: path.write_bytes(b"\x89MCAP0\r\n" + b"\xa5" * 500 + b"\x89MCAP0\r\n"),
        "is damaged",
    ),
    "folder": (lambda path: path.mkdir(), "cannot be read"),
}


@pytest.mark.parametrize("fault", BAD)
def test_files_that_are_no_recordings(tmp_path: Path, fault: str) -> None:
    make, said = BAD[fault]
    make(tmp_path / "a.mcap")
    for function in (lambda path: list(read(path)), summarize, read_attachments):
        with pytest.raises(CaptureError, match=said):
            function(tmp_path / "a.mcap")


def test_cut_files_say_how_to_restore_them(tmp_path: Path, write: Write) -> None:
    path = write(tmp_path / "a.mcap")
    data = path.read_bytes()
    assert is_finished(path)
    for size in (9, 100, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:size])
        assert not is_finished(path)
        with pytest.raises(CaptureError, match="rhot replay --recover"):
            list(read(path))


def test_damage_anywhere_is_an_error_or_harmless(
    tmp_path: Path, write: Write, payload: Payload
) -> None:
    """Every 97th byte of a file flipped in turn: the right payloads, or a CaptureError.

    Nothing else.
    """
    path = write(tmp_path / "a.mcap", 300)
    data = path.read_bytes()
    whole = [payload(seq) for seq in range(300)]
    refused = 0
    for at in range(0, len(data), 97):
        path.write_bytes(data[:at] + bytes([data[at] ^ 0x5A]) + data[at + 1 :])
        try:
            assert {r.payload for r in read(path)} <= set(whole)
        except CaptureError:
            refused += 1
    assert refused > 100


def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = RecordingWriter(tmp_path / "a.mcap", "desk")
    writer.add(topics.POSE, "rhot/desk/hand/left/pose", b"{}", 1)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=1_000_000))
    with pytest.raises(CaptureError, match="only 1 MB free"):
        writer.flush()
    with pytest.raises(CaptureError, match="only 1 MB free"):
        RecordingWriter(tmp_path / "b.mcap", "desk")
    writer.close()
    assert len(list(read(tmp_path / "a.mcap"))) == 1


def test_a_disk_that_takes_nothing_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("no /dev/full on this system")

    def open_full(_: Path, mode: str) -> IO[Any]:
        return io.open(full, mode.replace("x", "w"))  # noqa: UP020

    monkeypatch.setattr(Path, "open", open_full)
    with pytest.raises(CaptureError, match="No space left on device"):
        RecordingWriter(tmp_path / "a.mcap", "desk")


def test_folders_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CaptureError, match="cannot be recorded"):
        RecordingWriter(tmp_path / "file" / "a.mcap", "desk")
    with (
        RecordingWriter(tmp_path / "a.mcap", "desk"),
        pytest.raises(CaptureError, match="File exists"),
    ):
        RecordingWriter(tmp_path / "a.mcap", "desk")
