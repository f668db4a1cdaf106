import pytest

from rhot.errors import CaptureError
from rhot.files.capture import (
    Capture,
    FrameStamp,
    read_lines,
    read_stamps,
    write_lines,
    write_stamps,
)
from rhot.messages import Session


def test_stamps_round_trip(tmp_path):
    stamps = [
        FrameStamp(0, 1_700_000_000_000_000_001, 33_700.0),
        FrameStamp(2, 1_700_000_000_066_666_667, 33_700.5),
    ]
    path = Capture(tmp_path).stamps("left")
    write_stamps(path, stamps)
    assert path.read_text().startswith("frame,stamp_ns,row_time_ns\n0,1700000000000000001,33700\n")
    assert read_stamps(path) == stamps


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "line 1"),
        ("a,b\n", "line 1"),
        ("frame,stamp_ns,row_time_ns\n1,2,3\n1,x,3\n", "line 3"),
        ("frame,stamp_ns,row_time_ns\n1,2\n", "line 2"),
    ],
)
def test_broken_stamps_name_the_line(tmp_path, text, says):
    path = tmp_path / "left.csv"
    path.write_text(text)
    with pytest.raises(CaptureError, match=says):
        read_stamps(path)


def test_lines_round_trip_and_name_the_broken_one(tmp_path):
    path = tmp_path / "sessions.jsonl"
    sessions = [Session(running=True, start_ns=1), Session(running=False, start_ns=2)]
    assert write_lines(path, sessions) == 2
    assert list(read_lines(path, Session)) == sessions
    path.write_bytes(path.read_bytes() + b'{"running": 3}\n')
    with pytest.raises(CaptureError, match="line 3: not a Session"):
        list(read_lines(path, Session))
    with pytest.raises(CaptureError, match="cannot be read"):
        list(read_lines(tmp_path / "none.jsonl", Session))
