"""What `rhot track` tells that a running rig cannot: later frames, and a second look."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np

from rhot.files.capture import read_lines
from rhot.hand import JOINT_INDEX
from rhot.messages import HandPoints, HandPose
from services.cli.offline.inputs import job_of
from services.cli.offline.run import run


def test_a_hand_of_another_size_than_rig_toml_says_is_noted(capture, result, tmp_path):
    own = json.loads((result / "summary.json").read_text())["notes"]
    assert not any("never measured" in note for note in own)
    guessed = shutil.copytree(capture, tmp_path / "guessed")
    rig = guessed / "rig.toml"
    text, own_scale = rig.read_text(), "fingers = []\nscale = 1.0\n"
    assert own_scale in text
    rig.write_text(text.replace(own_scale, "scale = 0.88\n"))
    notes = run(job_of([str(guessed)], None), tmp_path / "out").notes
    assert len(notes) == len(own) + 1
    assert "the right hand was never measured" in notes[-1]
    assert 0.93 < float(notes[-1].split("scale = ")[1].split("`")[0]) < 1.07
    # Followed twice: it is that large from the first pose on, where a running rig learns it.
    run(job_of([str(guessed)], None), tmp_path / "live", as_live=True)
    assert growth(tmp_path / "out") < 0.03 < 0.06 < growth(tmp_path / "live")


def growth(result: Path) -> float:
    """How much longer a bone of the middle finger is in the last pose than in the first."""
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    ends = [JOINT_INDEX[f"middle_{bone}"] for bone in ("proximal", "intermediate")]
    first, last = (
        np.linalg.norm(np.subtract(*(pose.joints[end].position_m for end in ends)))
        for pose in (poses[0], poses[-1])
    )
    return float(last / first - 1.0)


def test_points_rest_on_later_frames_unless_asked_for_as_live(short_capture, tmp_path):
    def stamps(as_live: bool) -> list[int]:
        folder = tmp_path / str(as_live)
        run(job_of([str(short_capture)], None), folder, as_live=as_live)
        return [one.stamp_ns for one in read_lines(folder / "points.jsonl", HandPoints)]

    # As many either way: at the end those come out that waited.
    assert stamps(as_live=False) == stamps(as_live=True)
    points = [(tmp_path / name / "points.jsonl").read_bytes() for name in ("False", "True")]
    assert points[0] != points[1]
