"""What ends a service that systemd would start again at once."""

from __future__ import annotations

import socket
import threading
import time

import pytest

from rhot.errors import CalibrationError, SourceError
from rhot.process.restart_hold import hold_back, hold_s

DEADLINE_S = 60.0


@pytest.fixture
def held(monkeypatch):
    """As a unit sets it."""
    monkeypatch.setenv("RHOT_HOLD_S", "300")


def test_only_a_unit_holds_a_service(monkeypatch):
    monkeypatch.delenv("RHOT_HOLD_S", raising=False)
    assert hold_s(0.1, of_a_file=True) == 0.0


@pytest.mark.parametrize(
    ("lived_s", "of_a_file", "longest_s"),
    [(0.5, True, 300.0), (3600.0, True, 300.0), (0.5, False, 5.0), (3600.0, False, 0.0)],
)
def test_a_file_is_waited_for_and_a_crash_is_not(held, lived_s, of_a_file, longest_s):
    assert hold_s(lived_s, of_a_file=of_a_file) == longest_s


@pytest.mark.parametrize("change", ["new", "written", "permitted"])
def test_a_changed_file_ends_the_wait(held, tmp_path, change):
    folder = tmp_path / "calibration"
    folder.mkdir()
    (folder / "left.lens.json").write_text("{}")
    error = ExceptionGroup("tasks", [CalibrationError("rig.json is missing")])

    def mend() -> None:
        time.sleep(1.0)
        if change == "new":
            (folder / "rig.json").write_text("{}")
        elif change == "written":
            (folder / "left.lens.json").write_text("{ }")
        else:
            (folder / "left.lens.json").chmod(0o600)

    mender = threading.Thread(target=mend)
    started_s = time.monotonic()
    mender.start()
    hold_back(error, 0.1, [tmp_path / "rig.toml", folder])
    mender.join()
    assert 0.9 < time.monotonic() - started_s < DEADLINE_S


def test_systemd_sees_the_error_and_that_we_live(held, tmp_path, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind(str(tmp_path / "notify"))
        server.settimeout(60.0)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("RHOT_HOLD_S", "1")
        hold_back(SourceError("no camera\nat all"), 0.1, [])
        heard = server.recv(4096).decode().splitlines()
    assert heard[0].startswith("STATUS=no camera at all (")
    assert heard[1] == "WATCHDOG=1"
