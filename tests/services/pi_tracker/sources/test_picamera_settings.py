"""What the Raspberry Pi's camera is told, and whether it does so: exposure, processing,
synchronisation, sensor mode; against the stand-in of picamera2.
"""

from __future__ import annotations

import sys
import types

import numpy as np
import pytest

from rhot.errors import SourceError
from rhot.files.calibration import Exposure
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.sources.picamera import PiCamera
from services.pi_tracker.sources.picamera_settings import unpadded
from testing.picamera2 import PLAIN_PICTURE

FIXED = {
    "AeEnable": False,
    "AwbEnable": False,
    "ExposureTime": 8000,
    "AnalogueGain": 2.5,
    "ColourGains": (1.7, 1.4),
}


def note_of(camera):
    """The code and the text of the one thing that the camera has to say."""
    (((code, _), text),) = camera.notes.standing().items()
    return code, text


def set_controls(made):
    """What the camera was told while it ran, enums as numbers."""
    return [
        {name: int(value) if hasattr(value, "name") else value for name, value in one.items()}
        for one in made.set
    ]


def test_a_pi_cameras_auto_modes_are_off(opened):
    camera, made = opened(fps=40.0)
    config = made.camera_configuration()
    assert config["controls"] == PLAIN_PICTURE | FIXED | {
        "NoiseReductionMode": sys.modules["libcamera"].controls.draft.NoiseReductionModeEnum.Off,
        "FrameDurationLimits": (25_000, 25_000),
    }
    assert str(config["colour_space"]) == "<libcamera.ColorSpace 'SMPTE170M'>"
    assert config["queue"] is False
    assert config["sensor"] == {"output_size": (1296, 972), "bit_depth": 10}
    assert camera.notes.texts == []


def test_a_fast_camera_takes_the_mode_that_is_fast_enough(opened):
    camera, made = opened(fps=58.0)
    assert made.camera_configuration()["sensor"]["output_size"] == (640, 480)
    assert camera.read().row_time_ns == pytest.approx(33_700)


@pytest.fixture
def roles(picamera2, monkeypatch):
    """libcamera with software synchronisation: its controls.rpi.SyncModeEnum."""
    found = types.SimpleNamespace(Off=0, Server=1, Client=2)
    rpi = types.SimpleNamespace(SyncModeEnum=found)
    monkeypatch.setattr(sys.modules["libcamera"].controls, "rpi", rpi, False)
    return found


def test_a_client_without_a_server_says_so_and_delivers(opened, roles):
    camera, made = opened(sync="client")
    made.metadata["SyncReady"] = False
    assert [camera.read().seq for _ in range(1000)] == list(range(1000))
    (text,) = camera.notes.texts
    assert "not in step" in text
    # A partner that comes later is found all the same, and the word taken back.
    made.metadata["SyncReady"] = True
    camera.read()
    assert camera.notes.texts == []


def test_synchronising_at_full_speed_is_advised_against(opened, roles):
    camera, _ = opened(sync="client", fps=46.3)
    assert any("lower" in text for text in camera.notes.texts)


@pytest.mark.parametrize(("sync", "role"), [("server", "Server"), ("client", "Client")])
def test_pi_cameras_are_told_their_part_in_synchronisation(opened, roles, sync, role):
    camera, made = opened(sync=sync)
    assert made.camera_configuration()["controls"]["SyncMode"] == getattr(roles, role)
    made.metadata["SyncReady"] = True
    for _ in range(1000):
        camera.read()
    assert camera.notes.texts == []


def test_an_old_libcamera_cannot_synchronise(picamera2, monkeypatch, exposure):
    monkeypatch.setattr(sys.modules["libcamera"], "controls", types.SimpleNamespace(), False)
    with pytest.raises(SourceError, match="cannot synchronise"):
        PiCamera(CameraTable(name="left", sync="server"), 0, exposure).open()


def test_a_buffer_that_is_too_small_is_refused():
    with pytest.raises(SourceError, match="too small for 64x48"):
        unpadded(np.zeros(1000, np.uint8), (64, 48), 64)


def test_a_camera_runs_its_automatics_and_freezes_them(opened, exposure):
    camera, made = opened()
    made.metadata |= {"ExposureTime": 12_000, "AnalogueGain": 1.5, "ColourGains": (1.9, 1.3)}
    camera.read()
    assert set_controls(made) == [PLAIN_PICTURE]
    camera.controls.adjust(None)
    camera.read()
    assert made.set[1:] == [{"AeEnable": True, "AwbEnable": True}]
    assert camera.controls.reported == Exposure(
        exposure_us=12_000.0, gain=1.5, red_gain=1.9, blue_gain=1.3
    )
    camera.controls.adjust(exposure)
    camera.read()
    camera.read()
    assert made.set[2:] == [FIXED]


@pytest.mark.parametrize("missing", ["ExposureTime", "AnalogueGain", "ColourGains"])
def test_metadata_that_say_half_report_nothing(opened, missing):
    camera, made = opened()
    del made.metadata[missing]
    camera.read()
    assert camera.controls.reported is None


def test_a_camera_leaves_its_picture_as_it_is_and_hears_so(opened):
    camera, made = opened()
    # What is set at the start is reported with no frame: it must go with a request, too.
    assert set_controls(made) == [PLAIN_PICTURE]
    for _ in range(200):
        camera.read()
    assert camera.notes.texts == []


def test_a_camera_that_sharpens_all_the_same_says_which(opened):
    camera, made = opened()
    made.metadata |= {"Sharpness": 1.0, "NoiseReductionMode": 1}
    for _ in range(200):
        camera.read()
    (note,) = camera.notes.texts
    assert "Sharpness is 1 instead of 0" in note
    assert "NoiseReductionMode is 1 instead of 0" in note
    assert "Contrast" not in note


def test_a_camera_that_confirms_nothing_says_so(opened, monkeypatch):
    camera, made = opened(fps=30.0)
    made._carried.clear()
    for _ in range(60):
        camera.read()
    assert camera.notes.texts == []
    for _ in range(10):
        camera.read()
    code, text = note_of(camera)
    assert code == "camera_processing"
    assert "Sharpness = 0 is not confirmed" in text


def test_a_camera_without_such_a_control_says_so_and_runs(opened, picamera2, monkeypatch):
    known = {name: span for name, span in picamera2.known.items() if name != "NoiseReductionMode"}
    monkeypatch.setattr(picamera2, "known", known)
    camera, _ = opened()
    camera.read()
    code, text = note_of(camera)
    assert code == "camera_processing"
    assert "has no control NoiseReductionMode" in text


@pytest.mark.parametrize(("space", "full"), [("Smpte170m", False), ("Sycc", True)])
def test_a_camera_says_which_range_its_pictures_have(opened, picamera2, monkeypatch, space, full):
    made = getattr(sys.modules["libcamera"].ColorSpace, space)()
    monkeypatch.setattr(picamera2, "colour_space", made)
    camera, made = opened()
    assert camera.read().full_range is full
    assert camera.notes.texts == []


def test_a_camera_with_the_colours_of_hd_video_says_so(opened, picamera2, monkeypatch):
    space = sys.modules["libcamera"].ColorSpace.Rec709()
    monkeypatch.setattr(picamera2, "colour_space", space)
    camera, _ = opened()
    code, text = note_of(camera)
    assert code == "camera_processing"
    assert "Rec709" in text


@pytest.mark.parametrize(
    ("metadata", "told"),
    [
        ({"ExposureTime": 7983, "AnalogueGain": 2.56}, ""),
        ({"ExposureTime": 30_000}, "exposure_us is 30000 instead of 8000"),
        ({"AnalogueGain": 5.0}, "gain is 5 instead of 2.5"),
        ({"ColourGains": (1.7, 1.6)}, "blue_gain is 1.6 instead of 1.4"),
    ],
)
def test_a_camera_that_does_not_hold_its_exposure_says_so_and_when_it_does(opened, metadata, told):
    camera, made = opened(fps=30.0)
    right = dict(made.metadata)
    made.metadata |= metadata
    for _ in range(59):
        camera.read()
    assert camera.notes.texts == []
    for _ in range(100):
        camera.read()
    assert [(code, told in text) for (code, _), text in camera.notes.standing().items()] == (
        [("camera_automatic", True)] if told else []
    )
    made.metadata = right
    camera.read()
    assert camera.notes.texts == []
