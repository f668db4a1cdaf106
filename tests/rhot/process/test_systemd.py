import os
import socket

import pytest

from rhot.process import systemd


@pytest.mark.parametrize("abstract", [False, True])
def test_notify_reaches_the_socket(tmp_path, monkeypatch, abstract):
    path = f"@rhot-test-{os.getpid()}" if abstract else str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind("\0" + path[1:] if abstract else path)
        server.settimeout(60.0)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        assert systemd.notify("READY=1")
        assert server.recv(100) == b"READY=1"


def test_without_systemd_nothing_happens(monkeypatch, tmp_path):
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    assert not systemd.notify("READY=1")
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "gone"))
    assert not systemd.notify("READY=1")


def test_watchdog_is_ours_only_with_our_pid(monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", "3000000")
    monkeypatch.setenv("WATCHDOG_PID", str(os.getpid()))
    assert systemd.watchdog_s() == 1.5
    monkeypatch.setenv("WATCHDOG_PID", "1")
    assert systemd.watchdog_s() is None
    monkeypatch.delenv("WATCHDOG_USEC")
    assert systemd.watchdog_s() is None


def test_more_time_is_asked_for_until_ready_and_never_after(tmp_path, monkeypatch):
    monkeypatch.setattr(systemd, "_Start", type("Fresh", (), {"over": False}))
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind(str(tmp_path / "notify"))
        server.settimeout(60.0)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        systemd.ask_for_time()
        systemd.notify("READY=1\nSTATUS=running")
        systemd.ask_for_time()
        systemd.notify("STOPPING=1")
        heard = [server.recv(100) for _ in range(3)]
    assert heard == [b"EXTEND_TIMEOUT_USEC=120000000", b"READY=1\nSTATUS=running", b"STOPPING=1"]
