"""Contacts of a result folder, of a scene with a real solver."""

from __future__ import annotations

from rhot.files.capture import write_lines
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from services.cli.evaluate.contacts.score_contacts import contacts_text, score_contacts
from services.cli.offline.contacts import ContactTrack
from testing.synthetic_grasps import GraspScene, Setting, record


def test_a_result_is_scored_and_shown(tmp_path):
    scene = GraspScene(Setting(seed=1))
    recording = record(scene)
    size = (scene.setting.diameter_m, scene.setting.height_m)
    cup = ObjectTable(name="cup", serial="LHR-1", shape="cylinder", size_m=size)
    track = ContactTrack(RigConfig(object=[cup], folder=str(tmp_path)), recording.objects)
    write_lines(tmp_path / "contacts.jsonl", track.step(recording.hands))
    scores = score_contacts(recording.truth, tmp_path)
    assert scores["cup"].touches.found == 5
    assert scores["cup"].grasps.right == 1
    text = contacts_text(scores)
    rows = [line.split() for line in text.splitlines()]
    assert ["cup", "touches", "5/5", "0", "100"] in [row[:5] for row in rows]
    assert ["cup", "grasps", "1/1", "0"] in [row[:4] for row in rows]


def test_a_result_without_contacts_has_no_score(tmp_path):
    assert score_contacts([], tmp_path) == {}
