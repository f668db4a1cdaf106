"""Computers as their files in /sys show them: a Pi, a PC, and one that tells nothing."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from rhot.process.computer.readings import Computer, faults_of, read_computer, values_of

HEALTHY = {"computer_hot": {}, "computer_throttled": {}, "disk_low": {}}


@pytest.fixture
def machine(tmp_path):
    """`machine(zones, throttled, volt)`: the root of such a machine."""

    def make(zones, throttled=None, volt=None):
        for number, (kind, milli_c) in enumerate(zones):
            zone = tmp_path / f"sys/class/thermal/thermal_zone{number}"
            zone.mkdir(parents=True)
            (zone / "type").write_text(f"{kind}\n")
            (zone / "temp").write_text(f"{milli_c}\n")
        if throttled is not None:
            firmware = tmp_path / "sys/devices/platform/soc/soc:firmware"
            firmware.mkdir(parents=True)
            (firmware / "get_throttled").write_text(f"{throttled}\n")
        if volt is not None:
            monitor = tmp_path / "sys/class/hwmon/hwmon1"
            monitor.mkdir(parents=True)
            (monitor / "name").write_text("rpi_volt\n")
            (monitor / "in0_lcrit_alarm").write_text(f"{volt}\n")
        return tmp_path

    return make


def test_a_pi_that_is_well(machine):
    computer = read_computer(root=machine([("cpu-thermal", 54_500)], "0", "0"))
    assert (computer.temperature_c, computer.throttled) == (54.5, "")
    assert values_of(computer) == {"temperature_c": 54.5}
    assert faults_of(computer, "pi-left", ()) == HEALTHY


@pytest.mark.parametrize(
    ("throttled", "volt", "words"),
    [
        ("50005", "0", "its power supply is too weak, it is throttled"),
        ("80008", None, "it is at its soft limit of temperature"),
        # A kernel whose get_throttled is always 0.
        ("0", "1", "its power supply is too weak"),
        ("1", "1", "its power supply is too weak"),
    ],
)
def test_a_pi_that_has_slowed_down_says_why(machine, throttled, volt, words):
    computer = read_computer(root=machine([("cpu-thermal", 60_000)], throttled, volt))
    found = faults_of(computer, "pi-left", ())["computer_throttled"]
    assert found == {"pi-left": f"pi-left has slowed down: {words}"}


def test_what_was_before_is_not_now(machine):
    assert read_computer(root=machine([], "50000")).throttled == ""


def test_hot_is_something_else_on_a_pi_and_on_a_pc(machine, tmp_path):
    pi = read_computer(root=machine([("cpu-thermal", 79_000)]))
    assert faults_of(pi, "pi", ())["computer_hot"] == {"pi": "pi is at 79 C"}
    shutil.rmtree(tmp_path / "sys")
    pc = read_computer(root=machine([("iwlwifi_1", 99_000), ("x86_pkg_temp", 79_000)]))
    assert pc.temperature_c == 79.0
    assert faults_of(pc, "pc", ()) == HEALTHY


def test_a_fault_ends_a_little_later_than_it_begins():
    warm = Computer(75.0, 78.0, free_mb={"/": 550.0})
    assert faults_of(warm, "pi", ()) == HEALTHY
    still = faults_of(warm, "pi", ("computer_hot", "disk_low"))
    assert still["computer_hot"]
    assert still["disk_low"]
    assert faults_of(Computer(73.0, 78.0), "pi", ("computer_hot",)) == HEALTHY


def test_a_computer_that_tells_nothing_or_nonsense(machine, tmp_path):
    assert values_of(read_computer(root=tmp_path / "nowhere")) == {}
    odd = read_computer(root=machine([("cpu-thermal", "hot"), ("cpu-thermal", 9_999_000)], "none"))
    assert (odd.temperature_c, odd.throttled) == (None, None)
    assert faults_of(odd, "pi", ()) == HEALTHY


def test_free_space_is_that_of_each_file_system_once(tmp_path):
    folders = [tmp_path / "calibration", tmp_path / "recordings" / "to" / "come"]
    space = os.statvfs(tmp_path)
    computer = read_computer(folders)
    assert computer.free_mb is not None
    ((folder, free_mb),) = computer.free_mb.items()
    assert folder == str(tmp_path)
    assert free_mb == pytest.approx(space.f_bavail * space.f_frsize * 1e-6, rel=0.2)
    nearly_full = Computer(free_mb={"/var": 120.0, "/": 9000.0})
    assert faults_of(nearly_full, "pi", ())["disk_low"] == {
        "pi:/var": "120 MB are left in /var of pi"
    }
    assert values_of(nearly_full) == {"disk_free_mb": 120.0}


def test_this_computer_can_be_read():
    assert read_computer([Path("/")]).free_mb
