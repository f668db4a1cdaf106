"""`rhot tune filter` on folders, files and recordings."""

from __future__ import annotations

import json

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from rhot import topics
from rhot.errors import CaptureError
from rhot.files.capture import write_lines
from rhot.messages import HandPoint, HandPoints
from services.cli.offline.tune import tune
from services.cli.recorded import messages as recorded_messages
from services.recorder.writer import RecordingWriter
from testing.synthetic_points import START_NS, MovingHand


def messages() -> list[HandPoints]:
    """Four seconds still, four fast, 1 mm of noise."""
    random, path, found = np.random.default_rng(0), MovingHand(), []
    for k in range(240):
        place = path(np.array([max(0.0, k / 30.0 - 4.0)]))[0, 2] + random.normal(0.0, 1e-3, 3)
        point = HandPoint(
            name="index_tip",
            position_m=tuple(place.tolist()),
            sigma_m=(1e-3,) * 3,
            cameras=["left", "right"],
            source="measured",
        )
        found.append(
            HandPoints(
                hand="right", seq=k, stamp_ns=START_NS + round(k * 1e9 / 30.0), points=[point]
            )
        )
    return found


@pytest.fixture
def result(tmp_path):
    write_lines(tmp_path / "points.jsonl", messages())
    return tmp_path


def test_prints_a_table_and_toml_to_paste(result):
    run = CliRunner().invoke(tune, ["filter", str(result)])
    assert run.exit_code == 0, run.output
    assert "<- proposed" in run.output
    pasted = run.output[run.output.index("[fusion.one_euro]") :]
    table = msgspec.toml.decode(pasted)["fusion"]["one_euro"]
    assert 0.2 <= table["mincutoff_hz"] <= 20.0
    assert table["beta"] > 0.0


def test_json_and_a_file(result):
    run = CliRunner().invoke(
        tune, ["filter", str(result / "points.jsonl"), "--json", "--jitter", "0.7"]
    )
    assert run.exit_code == 0, run.output
    assert json.loads(run.output)["best"]["jitter_share"] <= 0.735


def test_reads_recordings(tmp_path):
    path, given = tmp_path / "hand.mcap", messages()[:5]
    with RecordingWriter(path, "desk") as writer:
        for message in given:
            writer.add(
                topics.POINTS,
                topics.POINTS.key("desk", hand="right"),
                msgspec.json.encode(message),
                message.stamp_ns,
            )
            writer.add(topics.SESSION, topics.SESSION.key("desk"), b"{}", message.stamp_ns)
    assert list(recorded_messages.messages(path, topics.POINTS, HandPoints, "points")) == given


@pytest.mark.parametrize("name", ["nothing.jsonl", "nothing.mcap"])
def test_a_missing_recording_is_an_error(tmp_path, name):
    with pytest.raises(CaptureError, match="cannot be read"):
        list(recorded_messages.messages(tmp_path / name, topics.POINTS, HandPoints, "points"))
