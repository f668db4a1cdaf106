import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files import calibration as cal

LENS = cal.Lens(
    size_px=(640, 480),
    matrix=((500.0, 0.0, 320.0), (0.0, 500.0, 240.0), (0.0, 0.0, 1.0)),
    distortion=(0.1, 0, 0, 0, 0),
)
EYE = tuple(tuple(float(i == j) for j in range(4)) for i in range(4))


def test_saved_and_loaded(tmp_path):
    cal.save(tmp_path / "deep" / "left.lens.json", LENS)
    assert cal.load_lens(tmp_path / "deep", "left") == LENS
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["left.lens.json"]


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "left.lens.json"
    cal.save(path, LENS)

    def broken_fsync(_):
        raise OSError("disk full")

    monkeypatch.setattr("os.fsync", broken_fsync)
    with pytest.raises(OSError, match="disk full"):
        cal.save(path, msgspec.structs.replace(LENS, size_px=(1, 1)))
    assert cal.load_lens(tmp_path, "left") == LENS
    assert len(list(tmp_path.iterdir())) == 1


def test_only_the_main_fields_are_needed_and_more_are_allowed(tmp_path):
    (tmp_path / "cam.colors.json").write_text(
        '{"colors": {"green": {"hsv_low": [35, 60, 40], "hsv_high": [85, 255, 255]}}, "new": 1}'
    )
    assert cal.load_colors(tmp_path, "cam").colors["green"].hsv_low == (35, 60, 40)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "rhot calibrate colors cam"),
        ('{"colors": {"g": {"hsv_low": [200, 0, 0], "hsv_high": [0, 0, 0]}}}', "hsv_low"),
        ("[]", "object"),
    ],
)
def test_broken_files_say_what_is_wrong(tmp_path, text, says):
    (tmp_path / "cam.colors.json").write_text(text)
    with pytest.raises(CalibrationError, match=says):
        cal.load_colors(tmp_path, "cam")


def test_a_missing_file_names_the_command_that_makes_it(tmp_path):
    with pytest.raises(CalibrationError, match="rhot calibrate stereo"):
        cal.load_geometry(tmp_path)


def test_cameras_need_lens_place_and_a_rigid_transform(tmp_path):
    cal.save(tmp_path / "left.lens.json", LENS)
    cal.save(
        tmp_path / "rig.json",
        cal.RigGeometry(cameras={"left": cal.CameraPlace(T_rig_from_camera=EYE)}),
    )
    assert np.allclose(cal.load_cameras(tmp_path, ["left"])["left"].matrix[0, 0], 500.0)
    with pytest.raises(CalibrationError, match="camera 'right' is missing"):
        cal.load_cameras(tmp_path, ["left", "right"])
    mirrored = ((-1.0, 0.0, 0.0, 0.0), *EYE[1:])
    cal.save(
        tmp_path / "rig.json",
        cal.RigGeometry(cameras={"left": cal.CameraPlace(T_rig_from_camera=mirrored)}),
    )
    with pytest.raises(CalibrationError, match="not a rigid transform"):
        cal.load_cameras(tmp_path, ["left"])


def test_a_hand_nobody_measured_comes_from_the_tables(tmp_path):
    model = cal.load_hand(tmp_path, "left", scale=0.9)
    assert model.origin == "tables"
    cal.save(tmp_path / "hand.right.json", model)
    with pytest.raises(CalibrationError, match="is of a left hand"):
        cal.load_hand(tmp_path, "right")


def test_a_lens_file_says_its_model_and_old_files_are_brown_conrady(tmp_path):
    wide = msgspec.structs.replace(LENS, distortion=(-0.03, 0.01, 0.0, 0.0), model="fisheye")
    cal.save(tmp_path / "left.lens.json", wide)
    assert cal.load_lens(tmp_path, "left") == wide
    old = msgspec.to_builtins(LENS)
    del old["model"]
    (tmp_path / "left.lens.json").write_bytes(msgspec.json.encode(old))
    assert cal.load_lens(tmp_path, "left") == LENS
    (tmp_path / "left.lens.json").write_bytes(msgspec.json.encode({**old, "model": "fisheye"}))
    with pytest.raises(CalibrationError, match="model fisheye has 4 numbers, not 5"):
        cal.load_lens(tmp_path, "left")
