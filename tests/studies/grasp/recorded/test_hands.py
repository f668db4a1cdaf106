"""Recordings of whole hands go through the study as a finger's do."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from studies.grasp.planar import joints_of
from studies.grasp.recorded.hands import hand_recording
from studies.grasp.recover.errors import errors_of
from studies.grasp.recover.study import Settings
from studies.grasp.track import finger_track
from tests.studies.grasp.conftest import recovered

DATA = Path(os.environ.get("RHOT_DATA", "")) / "hand_motion"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="real recordings: RHOT_DATA")


@needs_data
@pytest.mark.parametrize("finger", ["index", "little"])
def test_the_leap_fist(finger):
    made = hand_recording(DATA / "leap" / "grab.csv", finger)
    assert (made.finger, made.unit, made.method) == (finger, "mm", "recording")
    track = finger_track(made)
    # Its joints are those of its angles and bones: the plane of flexion holds all four.
    assert joints_of(track.angles_rad, np.array(made.lengths)) == pytest.approx(
        track.joints, abs=0.1
    )
    assert "0.0 mm RMS beside the plane" in made.notes[0]
    (found,) = recovered([made], Settings(methods=("dls", "closed-form")))
    assert len(found.sequences) == 2
    dls, _, closed, _ = errors_of([found])
    assert dls.joints[-1].rms < 1.0
    # This sensor draws DIP = PIP, which is not 2/3.
    assert closed.joints[2].rms > 5.0


@needs_data
def test_the_glove_has_tips_and_no_angles(tmp_path):
    source = DATA / "qualisys" / "recording.tsv.gz"
    # The first six seconds.
    lines = gzip.decompress(source.read_bytes()).decode().splitlines()[: 12 + 600]
    short = tmp_path / "glove.tsv"
    short.write_text("\n".join(lines))
    made = hand_recording(short, "index")
    assert made.subject == "glove"
    assert "no joints" in made.notes[0]
    assert 60.0 < sum(made.lengths) < 110.0
    track = finger_track(made)
    assert np.isnan(track.angles_rad).all()
    assert np.linalg.norm(track.tip, axis=1).max() < 1.1 * sum(made.lengths)
    (found,) = recovered([made], Settings(part="whole", methods=("dls-position", "dls")))
    position, pose = errors_of([found])
    assert position.frames == len(made.frames)
    assert position.joints[-1].rms is None
    assert pose.why_not_run
