"""Which files are written when."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from rhot import topics
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, Objects, RigTable, Viewer
from rhot.files.rig_tables import Recorder as RecorderTable
from rhot.messages import Session
from services.recorder.reader import read, read_attachments
from services.recorder.recorder import Recorder, attachments, recorded_topics, recording_path

KEY = "rhot/desk/control/session"
START_NS = 1_700_000_000_000_000_000


def session(running: bool, start_ns: int = START_NS) -> bytes:
    return msgspec.json.encode(Session(running=running, start_ns=start_ns))


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[Recorder]:
    found = Recorder(RigConfig(folder=str(tmp_path)), tmp_path / "r")
    yield found
    found.stop()


def say(recorder: Recorder, *payloads: bytes) -> None:
    for payload in payloads:
        recorder.add(topics.SESSION, KEY, payload, 5)


def point(recorder: Recorder) -> None:
    recorder.add(topics.POINTS, "rhot/desk/hand/right/points", b"{}", 5)


def test_names_are_utc_and_never_taken_twice(tmp_path: Path) -> None:
    first = recording_path(tmp_path, "desk", START_NS)
    assert first.name == "rhot-desk-20231114-221320.mcap"
    first.touch()
    assert recording_path(tmp_path, "desk", START_NS + 1).name == "rhot-desk-20231114-221320-2.mcap"
    assert recording_path(tmp_path, "desk", 2**63 - 1).name == "rhot-desk-22620411-234716.mcap"


def test_a_session_is_a_file_with_its_start_and_its_stop(
    recorder: Recorder, tmp_path: Path
) -> None:
    point(recorder)
    say(recorder, session(True))
    point(recorder)
    say(recorder, session(True))  # told again, e.g. to a late comer
    say(recorder, session(False))
    point(recorder)
    assert recorder.path is None
    (file,) = (tmp_path / "r").glob("*.mcap")
    assert [r.payload for r in read(file)] == [session(True), b"{}", session(True), session(False)]
    assert recorder.messages == 4
    assert "config.json" in read_attachments(file)


def test_the_next_session_is_the_next_file(recorder: Recorder, tmp_path: Path) -> None:
    say(recorder, session(True), session(True, START_NS + 60 * 10**9), session(False))
    assert [p.name for p in sorted((tmp_path / "r").iterdir())] == [
        "rhot-desk-20231114-221320.mcap",
        "rhot-desk-20231114-221420.mcap",
    ]


def test_autostart_records_between_sessions_too(tmp_path: Path) -> None:
    recorder = Recorder(RigConfig(recorder=RecorderTable(autostart=True)), tmp_path)
    recorder.start(START_NS)
    point(recorder)
    say(recorder, session(False), session(True, START_NS + 10**9), session(False, START_NS + 10**9))
    point(recorder)
    recorder.stop()
    assert [len(list(read(p))) for p in sorted(tmp_path.iterdir())] == [2, 3]


def test_by_hand_sessions_change_nothing(tmp_path: Path) -> None:
    recorder = Recorder(RigConfig(), tmp_path, follow_sessions=False)
    recorder.start(START_NS, tmp_path / "x.mcap")
    say(recorder, session(True), session(False), session(True, 7))
    recorder.stop()
    recorder.stop()
    assert [p.name for p in tmp_path.iterdir()] == ["x.mcap"]
    assert len(list(read(tmp_path / "x.mcap"))) == 3


@pytest.mark.parametrize(
    "garbage",
    [b"", b"\xff", b"[]", b'{"running": 1}', b'{"running": true, "start_ns": -1}', b"[" * 60_000],
)
def test_garbage_starts_nothing(recorder: Recorder, garbage: bytes) -> None:
    say(recorder, garbage)
    assert recorder.path is None
    say(recorder, session(True), garbage)
    assert recorder.messages == 2
    recorder.stop()


def test_truth_is_recorded_only_where_something_is_simulated() -> None:
    real = RigConfig(camera=[CameraTable(name="left")], objects=Objects(source="steamvr"))
    assert topics.TRUTH not in recorded_topics(real)
    assert {topics.MARKERS, topics.POSE, topics.SESSION, topics.HEALTH} < set(recorded_topics(real))
    assert topics.TRUTH in recorded_topics(
        RigConfig(camera=[CameraTable(name="left", source="simulator")], objects=real.objects)
    )
    assert topics.PREVIEW not in recorded_topics(RigConfig())


def test_attachments_are_the_configuration_and_the_calibration(tmp_path: Path) -> None:
    config = RigConfig(rig=RigTable(name="lab", calibration="c"), folder=str(tmp_path))
    assert set(attachments(config)) == {"config.json"}
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "rig.json").write_text("{}")
    (tmp_path / "c" / "huge.json").write_text(" " * 1_000_001)
    (tmp_path / "c" / "broken.json").symlink_to(tmp_path / "nowhere")
    files = attachments(config)
    assert set(files) == {"config.json", "calibration/rig.json"}
    assert msgspec.json.decode(files["config.json"], type=RigConfig) == config


def test_the_pages_token_is_not_recorded() -> None:
    config = RigConfig(viewer=Viewer(host="0.0.0.0", token="a-secret_of-16-or-more"))
    assert b"a-secret" not in attachments(config)["config.json"]


def test_a_storm_of_sessions_makes_a_few_files_and_loses_nothing(
    recorder: Recorder, tmp_path: Path
) -> None:
    for number in range(3000):
        payload = session(True, START_NS + number)
        recorder.add(topics.SESSION, KEY, payload, START_NS + number * 1_000_000)
    assert len(list((tmp_path / "r").glob("*.mcap"))) == 8
    assert recorder.messages == 3000
    assert recorder.postponed > 2900
    # A minute later the last one gets the file it was to have.
    recorder.flush(START_NS + 100 * 10**9)
    recorder.flush(START_NS + 101 * 10**9)
    assert len(list((tmp_path / "r").glob("*.mcap"))) == 9


def test_a_clock_that_is_set_back_does_not_hold_sessions_up(recorder: Recorder) -> None:
    for number in range(12):
        hour_ns = (24 - number) * 3600 * 10**9
        recorder.add(topics.SESSION, KEY, session(True, START_NS + number), START_NS + hour_ns)
    assert recorder.postponed == 0


@pytest.mark.parametrize("payload", [b"[" * 5000, b"[" * 60_000, b'{"running":' * 5000, b"\xff"])
def test_a_session_that_does_not_decode_starts_nothing(recorder: Recorder, payload: bytes) -> None:
    say(recorder, payload)
    assert recorder.path is None


def test_ten_thousand_names_leave_room_for_the_rigs_own(recorder: Recorder) -> None:
    say(recorder, session(True))
    for number in range(10_000):
        key = f"rhot/desk/camera/c{number}/markers"
        recorder.add(topics.MARKERS, key, b"{}", 6)
    assert recorder.refused == 10_000 - 64
    point(recorder)
    assert recorder.refused == 10_000 - 64
    assert recorder.messages == 1 + 64 + 1


def parts(tmp_path: Path, **limits: float) -> Recorder:
    config = RigConfig(folder=str(tmp_path), recorder=RecorderTable(**limits))
    return Recorder(config, tmp_path, follow_sessions=False)


def test_a_long_recording_goes_on_in_another_file_without_a_gap(tmp_path: Path) -> None:
    recorder = parts(tmp_path, part_minutes=1.0)
    recorder.start(START_NS)
    for second in range(150):
        recorder.add(topics.POINTS, "rhot/desk/hand/right/points", b"%d" % second, second)
        recorder.flush(START_NS + second * 10**9)
    recorder.stop()
    files = sorted(tmp_path.glob("*.mcap"))
    assert [path.name[-11:-5] for path in files] == ["221320", "221420", "221520"]
    kept = [int(record.payload) for path in files for record in read(path)]
    assert kept == list(range(150))


def test_parts_by_size_of_a_file_with_a_name_are_called_after_it(tmp_path: Path) -> None:
    recorder = parts(tmp_path, part_mb=1.0)
    recorder.start(START_NS, tmp_path / "mine.mcap")
    for second in range(5):
        recorder.add(topics.POINTS, "rhot/desk/hand/right/points", b"x" * 600_000, second)
        recorder.flush(START_NS + second)
    recorder.stop()
    files = [tmp_path / name for name in ("mine.mcap", "mine-2.mcap", "mine-3.mcap")]
    assert [len(list(read(path))) for path in files] == [2, 2, 1]


def test_a_clock_that_is_set_back_begins_no_part_early_and_none_never(tmp_path: Path) -> None:
    recorder = parts(tmp_path, part_minutes=1.0)
    recorder.start(START_NS)
    for at_s in (0, -3600, -3600 + 59):
        recorder.flush(START_NS + at_s * 10**9)
    assert len(list(tmp_path.glob("*.mcap"))) == 1
    recorder.flush(START_NS + (-3600 + 61) * 10**9)
    assert len(list(tmp_path.glob("*.mcap"))) == 2
    recorder.stop()
