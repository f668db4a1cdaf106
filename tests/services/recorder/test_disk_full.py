"""A full disk stops the recording, not the recorder."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import DiskFullError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from rhot.files.rig_tables import Recorder as RecorderTable
from rhot.process.service import Service
from services.recorder.reader import read
from services.recorder.recorder import Recorder
from services.recorder.service import serve
from testing.waiting import until

KEY = "rhot/desk/camera/left/markers"
CONFIG = RigConfig(camera=[CameraTable(name="left")], recorder=RecorderTable(autostart=True))


def test_a_write_that_fails_is_one_line_and_another_file_goes_on(
    tmp_path: Path, small_files: None
) -> None:
    recorder = Recorder(CONFIG, tmp_path)
    recorder.start(10**18)
    with pytest.raises(DiskFullError, match=r"rhot-desk-.*mcap: cannot be written: .*df -h"):
        for number in range(100):
            recorder.add(topics.MARKERS, KEY, os.urandom(10_000), number)
    recorder.suspend()
    assert recorder.path is None
    recorder.add(topics.MARKERS, KEY, b"lost", 1)
    assert recorder.lost == 1
    recorder.resume(10**18)
    recorder.add(topics.MARKERS, KEY, b"kept", 2)
    recorder.stop()
    second = tmp_path / "rhot-desk-20010909-014640-2.mcap"
    assert [record.payload for record in read(second)] == [b"kept"]


async def test_a_full_disk_is_a_fault_that_ends_with_space(
    running: Callable, small_disk: Path
) -> None:
    config = RigConfig(folder=str(small_disk), recorder=RecorderTable(autostart=True))
    filler = small_disk / "filler"
    service: Service
    bus: Bus
    async with running("recorder", serve, config, deadline_s=120.0) as (service, bus):

        def publish() -> None:
            bus.put_raw(KEY, b"x" * 100)

        def codes() -> set[str]:
            return {fault.code for fault in service.faults.standing()}

        await until(lambda: service.values.get("messages", 0) > 10, publish)
        filler.write_bytes(bytes(120_000_000))
        await until(lambda: "disk_full" in codes(), publish)
        # What to do about it is the fault's own line, once.
        assert "free some space" not in service.faults.standing()[0].text
        assert service.values["messages"] > 0
        filler.unlink()
        await until(lambda: "disk_full" not in codes(), publish)
        before = service.values["messages"]
        await until(lambda: service.values["messages"] > before, publish)
        assert service.state == "running"
    files = sorted((small_disk / "recordings").glob("*.mcap"))
    assert len(files) == 2
    # The first was finished while there was still room for its end.
    assert all(list(read(path)) for path in files)


async def test_a_disk_that_is_full_at_the_start_is_waited_for(
    running: Callable, small_disk: Path
) -> None:
    filler = small_disk / "filler"
    filler.write_bytes(bytes(130_000_000))
    config = RigConfig(folder=str(small_disk), recorder=RecorderTable(autostart=True))
    async with running("recorder", serve, config, deadline_s=120.0) as (service, bus):
        await until(
            lambda: any(fault.code == "disk_full" for fault in service.faults.standing()),
            lambda: None,
        )
        filler.unlink()
        await until(lambda: service.values.get("messages", 0) > 0, lambda: bus.put_raw(KEY, b"{}"))


async def test_a_storm_of_sessions_and_names_and_brackets_is_survived(
    running: Callable, tmp_path: Path
) -> None:
    config = RigConfig(folder=str(tmp_path), camera=[CameraTable(name="left")])
    session = topics.SESSION.key("desk")
    async with running("recorder", serve, config) as (service, bus):

        def attack() -> None:
            for payload in (b"[" * 5000, b"\xff", b"{}"):
                bus.put_raw(session, payload)
            for _number in range(20):
                attack.count += 1
                start = b'{"running":true,"start_ns":%d}' % attack.count
                bus.put_raw(session, start)
                bus.put_raw(f"rhot/desk/camera/c{attack.count}/markers", b"{}")

        attack.count = 0
        await until(lambda: service.values.get("refused", 0) > 200, attack)
        codes = {fault.code for fault in service.faults.standing()}
        assert {"request_refused", "names_flooded"} <= codes
        bus.put_raw(KEY, b"{}")
        assert service.state == "running"
    assert len(list((tmp_path / "recordings").glob("*.mcap"))) <= 8
