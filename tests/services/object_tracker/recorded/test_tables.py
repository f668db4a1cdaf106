"""Tables as people keep them: triad_openvr's logs, CSV files with headers, and damaged ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.errors import CaptureError
from rhot.messages.objects import OpenVrPose
from services.object_tracker.recorded.tables import read_table


@pytest.fixture
def read(tmp_path: Path):
    def of(content: str | bytes) -> list[OpenVrPose]:
        path = tmp_path / "table.txt"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return list(read_table(path, "T-1"))

    return of


def test_console_log_of_triad_openvr(read) -> None:
    """tracker_test.py's output in a file: what it found, then one line overwritten for ever."""
    poses = read(
        "Found 1 Trackers\r\n"
        "  tracker_1 (LHR-1234ABCD, VIVE Tracker Pro MV)\r\n"
        "Found 2 Tracking References\r\n"
        "  tracking_reference_1 (LHB-1, Mode B, Mode B)\r\n"
        "\r0.1000 0.2000 0.3000 90.0000 0.0000 0.0000 "
        "\r0.1000 0.2000 0.4000 180.0000 180.0000 0.0000 "
        "\r0.1000 0.2"
    )
    assert [pose.device.serial for pose in poses] == ["LHR-1234ABCD"] * 2
    assert [pose.mDeviceToAbsoluteTracking[2][3] for pose in poses] == [0.3, 0.4]
    assert poses[1].stamp_ns - poses[0].stamp_ns == 4_000_000
    # A half turn about z, exact but for the angle's own rounding.
    R = np.array(poses[1].mDeviceToAbsoluteTracking)[:, :3]
    np.testing.assert_allclose(R, np.diag([-1.0, -1.0, 1.0]), atol=1e-12)


@pytest.mark.parametrize(
    ("row", "serial"),
    [
        ("0.1 0.2 0.3 1 0 0 0", "T-1"),
        ("0.1, 0.2, 0.3, 1, 0, 0, 0", "T-1"),
        ("[0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0]", "T-1"),
        ("trackerPose:  [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0]", "T-1"),
        ("LHR-9 Quaternion     0.1000    0.2000    0.3000    1.0 0.0 0.0 0.0", "LHR-9"),
        ("LHR-9 Euler      0.1 0.2 0.3 0 0 0", "LHR-9"),
        ("1 0 0 0.1 0 1 0 0.2 0 0 1 0.3", "T-1"),
    ],
)
def test_rows_without_a_header(read, row: str, serial: str) -> None:
    (pose, _) = read(f"{row}\n{row}\n")
    assert pose.device.serial == serial
    rows = np.array(pose.mDeviceToAbsoluteTracking)
    np.testing.assert_allclose(rows, np.column_stack([np.eye(3), [0.1, 0.2, 0.3]]))


@pytest.mark.parametrize(
    ("time", "stamp_ns"),
    [
        ("0.5", 500_000_000),
        ("1598539762.25", 1_598_539_762_250_000_000),
        ("1598539762250", 1_598_539_762_250_000_000),
        ("1598539762250000", 1_598_539_762_250_000_000),
        ("1598539762250000123", 1_598_539_762_250_000_123),
    ],
)
def test_units_of_times_are_told_by_their_size(read, time: str, stamp_ns: int) -> None:
    for row in ("0 0 0 1 0 0 0", "0 0 0 10 20 30", "1 0 0 0 0 1 0 0 0 0 1 0"):
        (pose,) = read(f"{time} {row}\n")
        assert (pose.stamp_ns, pose.bPoseIsValid) == (stamp_ns, True)


@pytest.mark.parametrize(
    "header",
    [
        "time_ms,device,x_mm,y_mm,z_mm,qw,qx,qy,qz",
        "Time [ms]; Serial; X (mm); Y (mm); Z (mm); QW; QX; QY; QZ",
        "t_ms tracker px_mm py_mm pz_mm r_w r_x r_y r_z",
    ],
)
def test_columns_by_name(read, header: str) -> None:
    (pose,) = read(f"{header}\n1500,LHR-7,100,200,300,0,0,0,1\n")
    assert (pose.device.serial, pose.stamp_ns) == ("LHR-7", 1_500_000_000)
    rows = np.array(pose.mDeviceToAbsoluteTracking)
    np.testing.assert_allclose(rows[:, 3], [0.1, 0.2, 0.3])
    assert np.array_equal(rows[:, :3], np.diag([-1.0, -1.0, 1.0]))


def header_of(first: str, *names: str) -> str:
    """A header of a time and seven columns of each of two devices."""
    columns = [
        name.format(of)
        for of, unit in (("vive", ""), ("mocap", "_mm"))
        for name in (*(f"{name}{unit}" for name in names[:3]), *names[3:])
    ]
    return ",".join([first, *columns])


@pytest.mark.parametrize(
    "header",
    [
        header_of("time", *(f"{{}}_{name}" for name in ["x", "y", "z", "qw", "qx", "qy", "qz"])),
        header_of("t_s", *(f"{name}_{{}}" for name in ["x", "y", "z", "qw", "qx", "qy", "qz"])),
        header_of(
            "Time (s)",
            *(f"{{}} Position{axis}" for axis in "XYZ"),
            *(f"{{}} Rotation{axis}" for axis in "WXYZ"),
        ),
    ],
)
def test_two_systems_side_by_side(read, header: str) -> None:
    """A row has a pose of each; a sample that is missing is not valid."""
    poses = read(f"{header}\n0.002,1,2,3,1,0,0,0,100,200,300,0,0,0,1\n0.004,1,2,3,1,0,0,0,,,,,,,\n")
    told = [(pose.device.serial, pose.stamp_ns, pose.bPoseIsValid) for pose in poses]
    assert told == [
        ("vive", 2_000_000, True),
        ("mocap", 2_000_000, True),
        ("vive", 4_000_000, True),
        ("mocap", 4_000_000, False),
    ]
    np.testing.assert_allclose(
        np.array(poses[1].mDeviceToAbsoluteTracking),
        np.column_stack([np.diag([-1.0, -1.0, 1.0]), [0.1, 0.2, 0.3]]),
    )
    assert [pose.seq for pose in poses] == [0, 0, 2, 2]


def test_header_in_another_order(read) -> None:
    (pose,) = read("qx,qy,qz,qw,x,y,z,note\n0,0,1,0,1,2,3,still\n")
    rows = np.array(pose.mDeviceToAbsoluteTracking)
    assert np.array_equal(rows, np.column_stack([np.diag([-1.0, -1.0, 1.0]), [1.0, 2.0, 3.0]]))


def test_poses_that_cannot_be_are_invalid(read) -> None:
    """Kept in their place, so that the others' stamps stay right."""
    poses = read(
        "0 0 0 1 0 0 0\nNone\n0 0 0 0.9 0 0 0\nnan 0 0 1 0 0 0\n0 inf 0 1 0 0 0\n0 0 1 1 0 0 0\n"
    )
    assert [pose.bPoseIsValid for pose in poses] == [True, False, False, False, False, True]
    assert [pose.stamp_ns for pose in poses] == [i * 4_000_000 for i in range(6)]
    assert poses[3].mDeviceToAbsoluteTracking == ((0.0,) * 4,) * 3
    assert poses[3].eTrackingResult == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1 2 3 1 0 0 0\n1 2 3\n1 2 3 1 0 0 0\n", "line 2: not a pose: '1 2 3'"),
        ("x,y,z,qw,qx,qy,qz\n1,2,3,1,0,0,none\n1,2,3,1,0,0,0\n", "line 2: not a pose"),
        ("x,y,z,qw,qx,qy,qz,device\n1,2,3,1,0,0,0,a/b\n1,2,3,1,0,0,0,a\n", "line 2: not a pose"),
        ("x,y,z\n1,2,3\n", "no poses in it"),
        ("x,y,z,qw,qx,qy,qz\n", "no poses in it"),
        ("1 2 3 4 5\n" * 200, "line 100: not a pose"),
    ],
)
def test_what_is_no_table_is_told_with_its_line(read, text: str, said: str) -> None:
    with pytest.raises(CaptureError, match=said):
        read(text)


@settings(max_examples=200, deadline=None)
@given(
    st.binary(max_size=300)
    | st.text(alphabet="0123456789 .,-enaif\n\rxyzqw_#:[]", max_size=300).map(str.encode)
)
def test_no_content_breaks_it(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "fuzz.txt"
    path.write_bytes(content)
    try:
        poses = list(read_table(path, "T-1"))
    except CaptureError:
        return
    for pose in poses:
        assert pose.stamp_ns >= 0
        assert np.isfinite(pose.mDeviceToAbsoluteTracking).all()
