"""`rhot top` says what matters first, and fits whatever screen there is."""

from __future__ import annotations

import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable, RigTable
from rhot.plain_text import columns
from rhot.watch.rig_monitor import RigMonitor
from services.cli.live.top_screen import screen
from testing.sample_health import NOW_NS, beat, fault, stream

CONFIG = RigConfig(
    rig=RigTable(name="sim"),
    camera=[CameraTable(name="left"), CameraTable(name="right")],
    hand={"right": HandTable(markers={"index_tip": "blue"})},
)


@pytest.fixture
def monitor():
    monitor = RigMonitor(CONFIG, NOW_NS)
    for camera in ("left", "right"):
        streams = [stream(f"camera/{camera}/markers", latency_p50_ms=9.0)]
        values = {"markers": 1.0}
        monitor.beat(beat("pi_tracker", camera, streams=streams, values=values), NOW_NS)
    points = [stream("hand/right/points", latency_p50_ms=11.0)]
    monitor.beat(beat("fusion", streams=points), NOW_NS)
    monitor.beat(beat(), NOW_NS)
    return monitor


def shown(monitor, height=24, width=80):
    lines = screen(monitor.state(NOW_NS), width, height)
    assert height is None or len(lines) <= height
    assert all(columns(line) <= width for line in lines)
    assert all(line.isprintable() for line in lines)
    return lines


def test_a_rig_that_is_well(monitor):
    lines = shown(monitor)
    assert "all is well" in lines[0]
    assert "tracker 9.0 + fusion 2.0 + solver 10.0 = 21.0 ms glass to pose" in lines[1]
    (left,) = [line for line in lines if line.startswith("pi_tracker/left")]
    assert "1 of 1" in left


def test_faults_come_first_with_what_to_do(monitor):
    monitor.beat(
        beat("fusion", faults=[fault("disk_low"), fault("camera_moved", "left moved")]), NOW_NS
    )
    lines = shown(monitor)
    assert lines[2].startswith("ERROR   fusion: left moved [camera_moved]")
    assert "rhot calibrate stereo" in lines[3]
    assert lines[4].startswith("WARNING fusion:")
    assert "1 error, 1 warning" in lines[0]


@pytest.mark.parametrize("height", [4, 6, 10, 24, 50])
@pytest.mark.parametrize("width", [20, 80, 200])
@pytest.mark.parametrize(("faults", "services"), [(0, 0), (3, 3), (30, 3), (2, 60), (60, 60)])
def test_any_screen_is_enough(monitor, height, width, faults, services):
    for number in range(services):
        monitor.beat(beat("bridge", f"n{number}"), NOW_NS)
    found = [fault("camera_dark", "dark", f"c{number}") for number in range(faults)]
    monitor.beat(beat("fusion", faults=found), NOW_NS)
    shown(monitor, height, width)


def test_what_does_not_fit_is_counted(monitor):
    for number in range(40):
        monitor.beat(beat("bridge", f"n{number:02}"), NOW_NS)
    found = [fault("camera_dark", "dark", f"c{number}") for number in range(40)]
    monitor.beat(beat("fusion", faults=found), NOW_NS)
    lines = shown(monitor)
    told = sum(line.startswith("ERROR") for line in lines)
    assert f"... {40 - told} more faults" in lines
    rows = sum("running" in line for line in lines)
    assert f"... {44 - rows} more services" in lines
    # Without a limit all is there.
    assert sum("running" in line for line in shown(monitor, None, 120)) == 44


def test_a_slow_stream_is_marked(monitor):
    slow = stream(ok=False, rate_hz=3.0, rejected=5)
    monitor.beat(beat(streams=[slow]), NOW_NS)
    lines = shown(monitor)
    (row,) = [line for line in lines if line.startswith("solver")]
    assert "!3.0" in row
    (detail,) = [line for line in lines if "hand/right/pose" in line]
    assert detail.lstrip().startswith("! out")
    assert "rejected 5" in shown(monitor, None, 120)[-1]


def test_strangers_cannot_write_on_the_terminal(monitor):
    evil = "\x1b[2J\x1b]0;owned\x07\nrig desk  all is well\u202e"
    monitor.beat(beat("fusion", state=evil, faults=[fault("event", evil, evil)]), NOW_NS)
    for lines in (shown(monitor), shown(monitor, None, 200)):
        assert not any("\x1b" in line for line in lines)
        assert not any(line.startswith("rig desk") for line in lines)


def test_huge_figures_keep_their_columns(monitor):
    huge = stream(rate_hz=1e300, expected_hz=1e300, latency_p50_ms=1e300)
    monitor.beat(beat(uptime_s=1e300, cpu_percent=1e300, rss_mb=1e300, streams=[huge]), NOW_NS)
    shown(monitor)
