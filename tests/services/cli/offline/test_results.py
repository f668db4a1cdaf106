"""The result folder: complete or recognisably not, and nobody's files are lost."""

from __future__ import annotations

import msgspec
import pytest

from rhot.errors import CaptureError, DiskFullError
from rhot.messages import Session
from services.cli.offline.results import STREAMS, ResultWriter, check_result
from services.cli.offline.track_summary import Summary

LINE = Session(running=True, start_ns=1)


def summary(**counts) -> Summary:
    return Summary(
        rig="r",
        cameras={},
        **(dict.fromkeys(STREAMS, 0) | counts),
        refusals={},
        complete=True,
        warnings=[],
        notes=[],
    )


def write(folder, lines=1) -> None:
    with ResultWriter(folder) as writer:
        writer.write("poses", [LINE] * lines)
        writer.finish(summary(**writer.counts))


def test_a_finished_result_is_complete_and_holds_the_lines(tmp_path):
    write(tmp_path / "a" / "b", lines=3)
    check_result(tmp_path / "a" / "b", *STREAMS)
    assert (tmp_path / "a" / "b" / "poses.jsonl").read_bytes().count(b"\n") == 3
    assert b'"poses": 3' in (tmp_path / "a" / "b" / "summary.json").read_bytes()
    assert not list((tmp_path / "a" / "b").glob("*.partial"))


def test_a_second_run_replaces_the_first(tmp_path):
    write(tmp_path, lines=3)
    (tmp_path / "angles_right.png").write_bytes(b"picture")
    write(tmp_path, lines=1)
    assert (tmp_path / "poses.jsonl").read_bytes().count(b"\n") == 1


def test_foreign_files_are_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(CaptureError, match=r"thesis\.tex.*another folder"):
        ResultWriter(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["thesis.tex"]


def test_a_file_in_the_way_is_an_error(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(CaptureError, match="cannot be written"):
        ResultWriter(tmp_path / "out")


@pytest.mark.parametrize("before", [0, 2])
def test_an_interrupted_run_leaves_what_was_there(tmp_path, before):
    folder = tmp_path / "out"
    if before:
        write(folder, lines=before)
    with pytest.raises(KeyboardInterrupt), ResultWriter(folder) as writer:
        writer.write("poses", [LINE])
        raise KeyboardInterrupt
    assert folder.exists() == bool(before)
    if before:
        check_result(folder, "poses")
        assert (folder / "poses.jsonl").read_bytes().count(b"\n") == before


def test_a_run_that_was_killed_is_recognised_and_can_be_repeated(tmp_path):
    """Nothing is tidied up then; a bug leaves the same."""
    with pytest.raises(ZeroDivisionError), ResultWriter(tmp_path) as writer:
        writer.write("poses", [LINE] * (1 // 0))
    with pytest.raises(CaptureError, match="interrupted"):
        check_result(tmp_path, "poses")
    write(tmp_path)
    check_result(tmp_path, "poses")


def test_a_table_or_video_that_was_not_finished_does_not_spoil_the_result(tmp_path):
    write(tmp_path)
    (tmp_path / "angles.csv.partial").write_text("time_s")
    (tmp_path / "overlay_left.webm.partial").write_bytes(b"")
    check_result(tmp_path, "poses")
    write(tmp_path)


def test_a_failed_run_keeps_the_result_before_it(tmp_path):
    write(tmp_path, lines=2)
    with pytest.raises(CaptureError, match="no frame"), ResultWriter(tmp_path) as writer:
        writer.write("poses", [LINE])
        raise CaptureError("no frame")
    check_result(tmp_path, "poses")
    assert (tmp_path / "poses.jsonl").read_bytes().count(b"\n") == 2


def test_a_failed_first_run_leaves_no_folder(tmp_path):
    with pytest.raises(CaptureError), ResultWriter(tmp_path / "new"):
        raise CaptureError("no frame")
    assert not (tmp_path / "new").exists()


def test_what_is_missing_is_named(tmp_path):
    with pytest.raises(CaptureError, match="no such folder"):
        check_result(tmp_path / "nowhere")
    with pytest.raises(CaptureError, match=r"summary\.json"):
        check_result(tmp_path)
    write(tmp_path)
    (tmp_path / "points.jsonl").unlink()
    with pytest.raises(CaptureError, match=r"points\.jsonl"):
        check_result(tmp_path, "poses", "points")


@pytest.mark.parametrize("lines", [20_000, 200], ids=["while writing", "at the end"])
def test_a_disk_that_is_full_is_one_line_and_leaves_nothing(tmp_path, small_files, lines):
    """Some lines wait in a buffer, and do not fit when the file is closed."""
    folder = tmp_path / "out"
    line = msgspec.defstruct("Line", [("text", str)])("x" * 2_000)
    with (
        pytest.raises(DiskFullError, match=r"out: cannot be written: .*df -h"),
        ResultWriter(folder) as writer,
    ):
        writer.write("poses", [line] * lines)
        writer.finish(summary(**writer.counts))
    assert not folder.exists()


def test_a_full_disk_does_not_hide_a_bug(tmp_path, small_files):
    with pytest.raises(ZeroDivisionError), ResultWriter(tmp_path / "out") as writer:
        writer.write("poses", [LINE] * (1 // 0))
