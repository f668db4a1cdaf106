"""Recovery of cut and damaged recordings, and of one whose recorder was really killed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from rhot import topics
from rhot.errors import CaptureError
from services.recorder.reader import is_finished, read, read_attachments, summarize
from services.recorder.recover import recover, target_of, truncated_recordings
from services.recorder.writer import RecordingWriter

Write = Callable[..., Path]
Payload = Callable[[int], bytes]


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9, 0.999])
def test_a_cut_file(tmp_path: Path, write: Write, share: float, payload: Payload) -> None:
    path = write(tmp_path / "a.mcap")
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    done = recover(path)
    payloads = [r.payload for r in read(done.target)]
    assert payloads == [payload(seq) for seq in range(done.messages)]
    # All but the last chunk, of some 200 messages here.
    assert done.messages >= 1000 * share - 250
    assert summarize(done.target).rig == "desk"
    assert read_attachments(done.target) == {"config.json": b'{"rig": 1}'}
    assert not is_finished(path), "the broken file is left as it is"


def test_ten_minutes_of_a_killed_recorder(tmp_path: Path) -> None:
    """SIGKILL in the middle of writing, nothing flushed: at most a second is lost, of a rig that
    sends much and of one that sends next to nothing.
    """
    for name, rate_hz in (("busy", 100), ("quiet", 4)):
        path = tmp_path / f"{name}.mcap"
        script = f"""
import os, signal
from pathlib import Path
from rhot import topics
from services.recorder.writer import RecordingWriter
writer = RecordingWriter(Path({str(path)!r}), "desk")
for seq in range(600 * {rate_hz}):
    writer.add(topics.POSE, "rhot/desk/hand/left/pose", b"%d" % seq, seq * 10**9 // {rate_hz})
os.kill(os.getpid(), signal.SIGKILL)
"""
        assert subprocess.run([sys.executable, "-c", script], check=False).returncode == -9
        assert truncated_recordings(tmp_path) == [path]
        done = recover(path)
        payloads = [int(r.payload) for r in read(done.target)]
        assert payloads == list(range(done.messages))
        assert 600.0 - payloads[-1] / rate_hz <= 1.0
        assert truncated_recordings(tmp_path) == [], "recovered once is enough"


def test_what_was_flushed_is_never_lost(tmp_path: Path) -> None:
    """A single message, long before anything else comes."""
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        writer.add(topics.POSE, "rhot/desk/hand/left/pose", b"{}", 1)
        writer.flush()
        (tmp_path / "b.mcap").write_bytes((tmp_path / "a.mcap").read_bytes())
    assert recover(tmp_path / "b.mcap").messages == 1


def test_damage_in_the_middle_costs_only_its_chunk(
    tmp_path: Path, write: Write, payload: Payload
) -> None:
    path = write(tmp_path / "a.mcap")
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 50] = b"\x5a" * 50
    path.write_bytes(data)
    done = recover(path)
    assert done.damaged_chunks == 1
    assert 600 < done.messages < 1000
    assert {r.payload for r in read(done.target)} < {payload(seq) for seq in range(1000)}


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x89MCAP0\r\n",
        b"hello " * 50,
        b"\x89MCAP0\r\n" + bytes(500),
        b"\x89MCAP0\r\n" + b"\x06" + b"\xff" * 60,
    ],
)
def test_nothing_whole(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    with pytest.raises(CaptureError, match="no recording of rhot"):
        recover(path)
    assert list(tmp_path.iterdir()) == [path]


def test_a_beginning_without_messages(tmp_path: Path, write: Write) -> None:
    path = write(tmp_path / "a.mcap")
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(CaptureError, match="no whole message"):
        recover(path)
    assert list(tmp_path.iterdir()) == [path]


def test_missing_and_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="No such file"):
        recover(tmp_path / "a.mcap")


def test_a_file_being_recorded_is_left_alone(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.mcap", "desk") as writer:
        writer.flush()
        assert truncated_recordings(tmp_path) == []
        with pytest.raises(CaptureError, match="being recorded"):
            recover(tmp_path / "a.mcap")


def test_a_recovery_that_was_cut_is_done_again(tmp_path: Path, write: Write) -> None:
    path = write(tmp_path / "a.mcap")
    path.write_bytes(path.read_bytes()[:-5])
    (tmp_path / f".{target_of(path).name}.part").write_bytes(b"half")
    assert truncated_recordings(tmp_path) == [path]
    assert recover(path).messages == 1000


def test_whole_recordings_need_nothing(tmp_path: Path, write: Write) -> None:
    write(tmp_path / "a.mcap")
    (tmp_path / "notes.txt").write_text("")
    assert truncated_recordings(tmp_path) == []
    assert truncated_recordings(tmp_path / "missing") == []
