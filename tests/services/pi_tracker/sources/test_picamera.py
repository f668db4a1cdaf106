"""The Raspberry Pi's camera, against the stand-in of picamera2."""

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

PLAIN = {
    "Sharpness": 0.0,
    "NoiseReductionMode": 0,
    "Brightness": 0.0,
    "Contrast": 1.0,
    "Saturation": 1.0,
}
EXPOSURE = Exposure(exposure_us=8000.0, gain=2.5, red_gain=1.7, blue_gain=1.4)


def set_controls(made):
    """What the camera was told while it ran, enums as numbers."""
    return [
        {name: int(value) if hasattr(value, "name") else value for name, value in one.items()}
        for one in made.set
    ]


def table(**fields):
    return CameraTable(name="left", **fields)


@pytest.mark.parametrize("padding", [0, 64])
def test_a_pi_camera_delivers_packed_i420(picamera2, monkeypatch, padding):
    monkeypatch.setattr(picamera2, "padding", padding)
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    frame = camera.read()
    assert (frame.image.shape, frame.layout, frame.size_px) == ((720, 640), "i420", (640, 480))
    assert np.array_equal(
        frame.image[:480], np.broadcast_to((np.arange(480) % 200)[:, None], (480, 640))
    )
    chroma = frame.image[480:].reshape(2, 240, 320)
    assert (np.unique(chroma[0]), np.unique(chroma[1])) == ([90], [160])
    assert camera.read().seq == 1
    camera.close()
    (made,) = picamera2.made
    assert [request.released for request in made.requests] == [1, 1]
    assert made.closed


def test_a_pi_camera_stamps_the_middle_of_its_first_row(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    frame = camera.read()
    assert frame.stamp_ns == picamera2.WALL_NS - 4_000_000
    # 46 fps with the whole field of view: 972 lines of 33.7 us are read for 480 rows.
    assert frame.row_time_ns == pytest.approx(33_700 * 972 / 480)


def test_a_pi_cameras_auto_modes_are_off(picamera2):
    camera = PiCamera(table(fps=40.0), 0, EXPOSURE)
    camera.open()
    config = picamera2.made[0].camera_configuration()
    assert config["controls"] == PLAIN | {
        "NoiseReductionMode": sys.modules["libcamera"].controls.draft.NoiseReductionModeEnum.Off,
        "FrameDurationLimits": (25_000, 25_000),
        "AeEnable": False,
        "AwbEnable": False,
        "ExposureTime": 8000,
        "AnalogueGain": 2.5,
        "ColourGains": (1.7, 1.4),
    }
    assert str(config["colour_space"]) == "<libcamera.ColorSpace 'SMPTE170M'>"
    assert config["queue"] is False
    assert config["sensor"] == {"output_size": (1296, 972), "bit_depth": 10}
    assert camera.notes.texts == []


def test_a_fast_pi_camera_takes_the_mode_that_is_fast_enough(picamera2):
    camera = PiCamera(table(fps=58.0), 0, EXPOSURE)
    camera.open()
    assert picamera2.made[0].camera_configuration()["sensor"]["output_size"] == (640, 480)
    assert camera.read().row_time_ns == pytest.approx(33_700)


def test_a_pi_camera_without_calibration_says_so(picamera2):
    camera = PiCamera(table(), 0, None)
    camera.open()
    controls = picamera2.made[0].camera_configuration()["controls"]
    assert set(controls) == {"FrameDurationLimits", *PLAIN}
    assert camera.notes.standing().keys() == {("camera_automatic", "left")}
    camera.controls.adjust(EXPOSURE)
    camera.read()
    assert camera.notes.texts == []


@pytest.fixture
def roles(picamera2, monkeypatch):
    """libcamera with software synchronisation: its controls.rpi.SyncModeEnum."""
    found = types.SimpleNamespace(Off=0, Server=1, Client=2)
    rpi = types.SimpleNamespace(SyncModeEnum=found)
    monkeypatch.setattr(sys.modules["libcamera"].controls, "rpi", rpi, False)
    return found


@pytest.mark.parametrize(("sync", "role"), [("server", "Server"), ("client", "Client")])
def test_pi_cameras_are_told_their_part_in_synchronisation(picamera2, roles, sync, role):
    source = PiCamera(table(sync=sync), 0, EXPOSURE)
    source.open()
    assert picamera2.made[0].camera_configuration()["controls"]["SyncMode"] == getattr(roles, role)
    picamera2.made[0].metadata["SyncReady"] = True
    for _ in range(1000):
        source.read()
    assert source.notes.texts == []


def test_a_client_without_a_server_says_so_and_delivers(picamera2, roles):
    source = PiCamera(table(sync="client"), 0, EXPOSURE)
    source.open()
    picamera2.made[0].metadata["SyncReady"] = False
    assert [source.read().seq for _ in range(1000)] == list(range(1000))
    (text,) = source.notes.texts
    assert "not in step" in text
    # A partner that comes later is found all the same, and the word taken back.
    picamera2.made[0].metadata["SyncReady"] = True
    source.read()
    assert source.notes.texts == []


def test_synchronising_at_full_speed_is_advised_against(picamera2, roles):
    source = PiCamera(table(sync="client", fps=46.3), 0, EXPOSURE)
    source.open()
    assert any("lower" in text for text in source.notes.texts)


def test_an_old_libcamera_cannot_synchronise(picamera2, monkeypatch):
    monkeypatch.setattr(sys.modules["libcamera"], "controls", types.SimpleNamespace(), False)
    with pytest.raises(SourceError, match="cannot synchronise"):
        PiCamera(table(sync="server"), 0, EXPOSURE).open()


def test_an_unknown_sensor_has_no_row_time(picamera2, monkeypatch):
    monkeypatch.setattr(picamera2, "cameras", [{"Model": "imx999"}])
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    assert camera.read().row_time_ns == 0.0
    assert any("readout time is unknown" in text for text in camera.notes.texts)


def test_a_pi_camera_that_falls_silent_fails(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    camera.read()
    picamera2.made[0].silent = True
    with pytest.raises(SourceError, match="camera 'left': no image for 2 s"):
        camera.read()


def test_an_old_system_without_wall_clock_stamps_fails(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    del picamera2.made[0].metadata["FrameWallClock"]
    with pytest.raises(SourceError, match="no FrameWallClock; update with `sudo apt full-upgrade`"):
        camera.read()
    assert picamera2.made[0].requests[0].released == 1


def test_a_pi_camera_that_is_not_there_is_named(picamera2):
    with pytest.raises(SourceError, match="has no camera 3; it has 0: ov5647"):
        PiCamera(table(), 3, EXPOSURE).open()


def test_a_pi_camera_in_use_is_named(picamera2, monkeypatch):
    def busy(self):
        raise RuntimeError("Failed to acquire camera: Device or resource busy")

    monkeypatch.setattr(picamera2, "start", busy)
    with pytest.raises(
        SourceError, match=r"cannot be started: .*busy; does another program use it"
    ):
        PiCamera(table(), 0, EXPOSURE).open()


def test_a_missing_package_is_named_with_its_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    with pytest.raises(SourceError, match="sudo apt install python3-picamera2"):
        PiCamera(table(), 0, EXPOSURE).open()


def test_a_buffer_that_is_too_small_is_refused():
    with pytest.raises(SourceError, match="too small for 64x48"):
        unpadded(np.zeros(1000, np.uint8), (64, 48), 64)


def test_a_pi_camera_runs_its_automatics_and_freezes_them(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    (fake,) = picamera2.made
    fake.metadata |= {"ExposureTime": 12_000, "AnalogueGain": 1.5, "ColourGains": (1.9, 1.3)}
    camera.read()
    assert set_controls(fake) == [PLAIN]
    camera.controls.adjust(None)
    camera.read()
    assert fake.set[1:] == [{"AeEnable": True, "AwbEnable": True}]
    assert camera.controls.reported == Exposure(
        exposure_us=12_000.0, gain=1.5, red_gain=1.9, blue_gain=1.3
    )
    camera.controls.adjust(EXPOSURE)
    camera.read()
    camera.read()
    assert fake.set[2:] == [
        {
            "AeEnable": False,
            "AwbEnable": False,
            "ExposureTime": 8000,
            "AnalogueGain": 2.5,
            "ColourGains": (1.7, 1.4),
        }
    ]


@pytest.mark.parametrize("missing", ["ExposureTime", "AnalogueGain", "ColourGains"])
def test_metadata_that_say_half_report_nothing(picamera2, missing):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    del picamera2.made[0].metadata[missing]
    camera.read()
    assert camera.controls.reported is None


def test_a_pi_camera_leaves_its_picture_as_it_is_and_hears_so(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    (fake,) = picamera2.made
    # What is set at the start is reported with no frame: it must go with a request, too.
    assert set_controls(fake) == [PLAIN]
    for _ in range(200):
        camera.read()
    assert camera.notes.texts == []


def test_a_pi_camera_that_sharpens_all_the_same_says_which(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    picamera2.made[0].metadata |= {"Sharpness": 1.0, "NoiseReductionMode": 1}
    for _ in range(200):
        camera.read()
    (note,) = camera.notes.texts
    assert "Sharpness is 1 instead of 0" in note
    assert "NoiseReductionMode is 1 instead of 0" in note
    assert "Contrast" not in note


def test_a_pi_camera_that_confirms_nothing_says_so(picamera2, monkeypatch):
    camera = PiCamera(table(fps=30.0), 0, EXPOSURE)
    camera.open()
    picamera2.made[0]._carried.clear()
    for _ in range(60):
        camera.read()
    assert camera.notes.texts == []
    for _ in range(10):
        camera.read()
    (((code, _), text),) = camera.notes.standing().items()
    assert (code, "Sharpness = 0 is not confirmed" in text) == ("camera_processing", True)


def test_a_pi_camera_without_such_a_control_says_so_and_runs(picamera2, monkeypatch):
    known = {name: span for name, span in picamera2.known.items() if name != "NoiseReductionMode"}
    monkeypatch.setattr(picamera2, "known", known)
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    camera.read()
    (((code, _), text),) = camera.notes.standing().items()
    assert (code, "has no control NoiseReductionMode" in text) == ("camera_processing", True)


@pytest.mark.parametrize(("space", "full"), [("Smpte170m", False), ("Sycc", True)])
def test_a_pi_camera_says_which_range_its_pictures_have(picamera2, monkeypatch, space, full):
    made = getattr(sys.modules["libcamera"].ColorSpace, space)()
    monkeypatch.setattr(picamera2, "colour_space", made)
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    assert camera.read().full_range is full
    assert camera.notes.texts == []


def test_a_pi_camera_with_the_colours_of_hd_video_says_so(picamera2, monkeypatch):
    space = sys.modules["libcamera"].ColorSpace.Rec709()
    monkeypatch.setattr(picamera2, "colour_space", space)
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    (((code, _), text),) = camera.notes.standing().items()
    assert (code, "Rec709" in text) == ("camera_processing", True)


@pytest.mark.parametrize(
    ("metadata", "told"),
    [
        ({"ExposureTime": 7983, "AnalogueGain": 2.56}, ""),
        ({"ExposureTime": 30_000}, "exposure_us is 30000 instead of 8000"),
        ({"AnalogueGain": 5.0}, "gain is 5 instead of 2.5"),
        ({"ColourGains": (1.7, 1.6)}, "blue_gain is 1.6 instead of 1.4"),
    ],
)
def test_a_pi_camera_that_does_not_hold_its_exposure_says_so_and_when_it_does(
    picamera2, metadata, told
):
    camera = PiCamera(table(fps=30.0), 0, EXPOSURE)
    camera.open()
    (fake,) = picamera2.made
    right = dict(fake.metadata)
    fake.metadata |= metadata
    for _ in range(59):
        camera.read()
    assert camera.notes.texts == []
    for _ in range(100):
        camera.read()
    assert [(code, told in text) for (code, _), text in camera.notes.standing().items()] == (
        [("camera_automatic", True)] if told else []
    )
    fake.metadata = right
    camera.read()
    assert camera.notes.texts == []
