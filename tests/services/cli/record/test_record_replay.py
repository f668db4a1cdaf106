"""`rhot record` and `rhot replay` as a person uses them, against a real router."""

from __future__ import annotations

import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import typer
import zenoh
from typer.testing import CliRunner

from rhot import topics
from rhot.bus.bus import client_config
from rhot.errors import BusError, CaptureError
from services.cli.defaults import config_dir
from services.cli.record.record import record
from services.cli.record.replay import replay
from services.recorder.reader import read
from services.recorder.writer import RecordingWriter

Invoke = Callable[..., str]


@pytest.fixture
def rig_toml(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text('[rig]\nname = "desk"\n')
    return path


@pytest.fixture
def invoke() -> Invoke:
    """Run one of the two commands; what it printed. An error the user can mend is raised."""

    def run(*arguments: object, code: int = 0) -> str:
        app = typer.Typer()
        app.command(name="record")(record)
        app.command(name="replay")(replay)
        result = CliRunner().invoke(app, [str(a) for a in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == code, result.output
        return result.output

    return run


@pytest.fixture
def talking(router: str) -> Iterator[str]:
    """A rig that publishes markers, 200 a second; its router."""
    stop = threading.Event()

    def talk() -> None:
        with zenoh.open(client_config([router])) as session:
            while not stop.wait(0.005):
                session.put("rhot/desk/camera/left/markers", b"{}")

    thread = threading.Thread(target=talk)
    thread.start()
    yield router
    stop.set()
    thread.join()


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    with RecordingWriter(tmp_path / "some.mcap", "desk") as writer:
        for seq in range(20):
            writer.add(topics.MARKERS, "rhot/desk/camera/left/markers", b"{}", seq * 10_000_000)
    return tmp_path / "some.mcap"


def test_record_for_some_seconds(
    talking: str, rig_toml: Path, tmp_path: Path, invoke: Invoke
) -> None:
    said = invoke(
        "record",
        "--config",
        rig_toml,
        "--connect",
        talking,
        "--seconds",
        0.5,
        "--out",
        tmp_path / "x.mcap",
    )
    count = len(list(read(tmp_path / "x.mcap")))
    assert count > 20
    assert f"{count} messages" in said
    with pytest.raises(CaptureError, match="never overwritten"):
        invoke("record", "--config", rig_toml, "--out", tmp_path / "x.mcap")


def test_record_into_a_folder_until_ctrl_c(talking: str, rig_toml: Path, tmp_path: Path) -> None:
    code = "import typer; from services.cli.record.record import record; typer.run(record)"
    command = [
        sys.executable,
        "-c",
        code,
        "--config",
        str(rig_toml),
        "--connect",
        talking,
        "--out",
        str(tmp_path / "r"),
    ]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        assert "recording into" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=10)
    (path,) = (tmp_path / "r").glob("rhot-desk-*.mcap")
    count = len(list(read(path)))
    assert f"{count} messages" in out
    # 1 says that nothing came before Ctrl-C, which may be.
    assert process.returncode == (0 if count else 1), err


def test_record_nothing(router: str, rig_toml: Path, tmp_path: Path, invoke: Invoke) -> None:
    said = invoke("record", "--config", rig_toml, "--connect", router, "--seconds", 0.1, code=1)
    assert "nothing arrived of rig 'desk'" in said
    assert len(list((tmp_path / "recordings").iterdir())) == 1


def test_without_a_rig_toml_it_records_into_the_current_folder(
    router: str, tmp_path: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Never beside the configuration that rhot ships, which is part of the installed package."""
    monkeypatch.chdir(tmp_path)
    invoke("record", "--connect", router, "--seconds", 0.1, code=1)
    assert len(list((tmp_path / "recordings").glob("rhot-sim-*.mcap"))) == 1
    assert not (config_dir() / "recordings").exists()


def test_no_router(
    endpoint: str, rig_toml: Path, recording: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("services.cli.router_session._TIMEOUT_S", 0.3)
    for arguments in (["record"], ["replay", recording]):
        with pytest.raises(BusError, match="no router answers"):
            invoke(*arguments, "--config", rig_toml, "--connect", endpoint)


def test_replay(router: str, rig_toml: Path, recording: Path, invoke: Invoke) -> None:
    heard: queue.Queue[str] = queue.Queue()
    with (
        zenoh.open(client_config([router])) as session,
        session.declare_subscriber("rhot/**", lambda s: heard.put(str(s.key_expr))),
    ):
        assert "replayed 20 messages" in invoke(
            "replay", recording, "--config", rig_toml, "--connect", router, "--rate", 0
        )
        keys = [heard.get(timeout=5.0) for _ in range(20)]
    assert keys == ["rhot/desk/camera/left/markers"] * 20
    assert heard.empty()


def test_replay_of_a_part(router: str, rig_toml: Path, recording: Path, invoke: Invoke) -> None:
    """Messages lie 10 ms apart, from 0 to 0.19 s."""
    where = ("--config", rig_toml, "--connect", router, "--rate", 0)
    for part, count in (
        (("--from", 0.1), 10),
        (("--to", "-0.1"), 10),
        (("--from", "-0.05", "--to", "-0.02"), 4),
        (("--from", 0.19), 1),
    ):
        assert f"replayed {count} messages" in invoke("replay", recording, *where, *part)
    with pytest.raises(CaptureError, match="--from must come before --to"):
        invoke("replay", recording, *where, "--from", 0.15, "--to", 0.05)


def test_replay_info(recording: Path, invoke: Invoke) -> None:
    said = invoke("replay", recording, "--info")
    assert "rig 'desk', 20 messages in 0.2 s" in said
    assert "20  rhot/desk/camera/left/markers" in said


def test_replay_recovers(recording: Path, invoke: Invoke) -> None:
    recording.write_bytes(recording.read_bytes()[:-9])
    with pytest.raises(CaptureError, match="--recover"):
        invoke("replay", recording)
    assert "20 messages restored" in invoke("replay", recording, "--recover")
    assert len(list(read(recording.with_name("some.recovered.mcap")))) == 20


def test_replay_refuses(tmp_path: Path, recording: Path, invoke: Invoke) -> None:
    with pytest.raises(CaptureError, match="cannot be read"):
        invoke("replay", tmp_path / "missing.mcap")
    with pytest.raises(CaptureError, match="no recorded topic is called 'marker'"):
        invoke("replay", recording, "--only", "marker")


def test_a_disk_that_is_full_is_one_line(talking: str, small_disk: Path) -> None:
    """In a process of its own, as a person sees it."""
    (small_disk / "filler").write_bytes(bytes(130_000_000))
    program = [sys.executable, "-m", "services.cli", "record", "--seconds", "20"]
    done = subprocess.run(
        [*program, "--out", str(small_disk / "a.mcap"), "--connect", talking],
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "MB free, recordings need 50" in line
