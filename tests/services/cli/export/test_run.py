"""Tables of `rhot export`, opened as their users open them."""

from __future__ import annotations

import shutil
from itertools import count

import msgspec
import numpy as np
import pandas as pd
import pytest

from rhot.errors import CaptureError
from rhot.files.capture import read_lines
from rhot.hand import DIGITS, JOINTS
from rhot.messages import HandPoints, HandPose, MarkerFrame
from services.cli.export.run import export
from services.cli.export.tables import TABLES


@pytest.fixture(scope="module")
def tables(result, tmp_path_factory):
    """The result as CSV and Parquet."""
    out = tmp_path_factory.mktemp("tables")
    export(result, out, ["csv", "parquet"])
    return out


def test_pandas_opens_every_table_alike_from_csv_and_parquet(tables):
    names = sorted(path.stem for path in tables.glob("*.csv"))
    assert names == ["angles", "contacts", "markers", "objects", "points", "poses"]
    for name in names:
        from_csv = pd.read_csv(tables / f"{name}.csv", keep_default_na=True)
        from_parquet = pd.read_parquet(tables / f"{name}.parquet")
        table = next(table for table in TABLES if table.name == name)
        assert list(from_csv.columns) == [column for column, _ in table.columns]
        assert len(from_csv) == len(from_parquet) > 0
        assert from_csv.stamp_ns.dtype == from_parquet.stamp_ns.dtype == np.int64
        for column, kind in table.columns:
            if kind is float and from_csv[column].notna().any():
                assert np.allclose(from_csv[column], from_parquet[column], equal_nan=True)
            elif kind is str:
                assert from_csv[column].fillna("").tolist() == from_parquet[column].tolist()


def test_angles_are_those_of_the_poses_in_degrees_and_seconds(tables, result):
    angles = pd.read_csv(tables / "angles.csv")
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    assert len(angles) == len(poses)
    for k in (0, len(poses) // 2, -1):
        row, index = angles.iloc[k], poses[k].fingers[1]
        assert row.stamp_ns == poses[k].stamp_ns
        assert row.index_pip_deg == pytest.approx(np.rad2deg(index.angles_rad.pip), abs=1e-3)
        assert row.thumb_cmc_deg == pytest.approx(
            np.rad2deg(poses[k].fingers[0].angles_rad.cmc), abs=1e-3
        )
        assert row.index_status == index.status
    assert np.allclose(np.diff(angles.time_s), np.diff(angles.stamp_ns) * 1e-9, atol=1e-5)
    assert 0.0 <= angles.time_s.iloc[0] < 0.2
    for digit in DIGITS:
        assert f"{digit}_residual_mm" in angles.columns


def test_points_and_joints_are_in_millimetres(tables, result):
    points, poses = pd.read_csv(tables / "points.csv"), pd.read_csv(tables / "poses.csv")
    first = next(line for line in read_lines(result / "points.jsonl", HandPoints) if line.points)
    row = points[points.stamp_ns == first.stamp_ns].iloc[0]
    assert row[["x_mm", "y_mm", "z_mm"]].tolist() == pytest.approx(
        [1e3 * value for value in first.points[0].position_m], abs=1e-3
    )
    assert set(poses.joint) == set(JOINTS)
    assert np.allclose(np.linalg.norm(poses[["qw", "qx", "qy", "qz"]], axis=1), 1.0, atol=1e-5)


def test_a_marker_has_its_own_instant(tables, result):
    """A rolling shutter exposes it as many rows later as it lies deep in the picture."""
    markers = pd.read_csv(tables / "markers.csv")
    frame = next(one for one in read_lines(result / "markers.jsonl", MarkerFrame) if one.markers)
    own = markers[(markers.camera == frame.camera) & (markers.frame == frame.seq)]
    late_ns = own.stamp_ns - (frame.stamp_ns - frame.clock_offset_ns)
    assert np.allclose(late_ns, own.y_px * frame.row_time_ns, atol=100.0)
    assert late_ns.max() > 1e6


def test_a_recording_gives_the_same_tables_as_the_result(recording, tables, tmp_path):
    written = export(recording, tmp_path, ["csv"])
    for path, rows in written.items():
        ours, theirs = pd.read_csv(path), pd.read_csv(tables / path.name)
        assert len(ours) == rows == len(theirs)
        order = [ours.columns[-1], *ours.columns[1:3]]
        ours, theirs = (one.sort_values(order, ignore_index=True) for one in (ours, theirs))
        pd.testing.assert_frame_equal(
            ours.drop(columns="time_s"), theirs.drop(columns="time_s"), check_dtype=False
        )


def test_only_the_tables_asked_for(result, tmp_path):
    written = export(result, tmp_path, ["csv"], ["angles"])
    assert [path.name for path in written] == ["angles.csv"]
    assert [path.name for path in tmp_path.iterdir()] == ["angles.csv"]


def test_a_damaged_line_leaves_the_tables_of_before(result, tmp_path):
    folder = tmp_path / "result"
    shutil.copytree(result, folder)
    export(folder, folder, ["csv"])
    before = (folder / "angles.csv").read_bytes()
    lines = (folder / "poses.jsonl").read_bytes().splitlines(keepends=True)
    (folder / "poses.jsonl").write_bytes(b"".join([*lines[:5], b"{no\n", *lines[6:]]))
    with pytest.raises(CaptureError, match=r"poses\.jsonl: line 6: not a HandPose"):
        export(folder, folder, ["csv"])
    assert (folder / "angles.csv").read_bytes() == before
    assert not list(folder.glob("*.partial"))


def test_an_empty_result_says_so(result, tmp_path):
    folder = tmp_path / "result"
    shutil.copytree(result, folder)
    for path in folder.glob("*.jsonl"):
        path.write_bytes(b"")
    with pytest.raises(CaptureError, match="holds no markers, points, poses or objects"):
        export(folder, tmp_path / "out", ["csv"])
    assert not (tmp_path / "out").exists()


def test_a_table_that_is_empty_now_is_removed(result, tmp_path):
    folder = tmp_path / "result"
    shutil.copytree(result, folder)
    export(folder, folder, ["csv"])
    (folder / "objects.jsonl").write_bytes(b"")
    written = export(folder, folder, ["csv"])
    assert folder / "objects.csv" not in written
    assert not (folder / "objects.csv").exists()


def test_long_recordings_are_written_in_batches(result, tmp_path):
    """Many more messages than are gathered before writing, all of them there in order."""
    folder = tmp_path / "result"
    shutil.copytree(result, folder)
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    times = count(poses[0].stamp_ns, 33_000_000)
    with (folder / "poses.jsonl").open("wb") as file:
        for _ in range(20):
            for pose in poses:
                moved = msgspec.structs.replace(pose, stamp_ns=next(times))
                file.write(msgspec.json.encode(moved) + b"\n")
    written = export(folder, tmp_path / "out", ["csv"], ["poses"])
    table = pd.read_csv(tmp_path / "out" / "poses.csv")
    assert list(written.values()) == [len(table)] == [20 * len(poses) * len(JOINTS)]
    assert len(table) > 20_000
    assert table.stamp_ns.is_monotonic_increasing
