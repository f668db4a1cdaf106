"""`rhot calibrate objects` from recordings, from points, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from rhot import topics
from rhot.errors import CalibrationError, CaptureError
from rhot.files.calibration import ObjectPlace, Objects, load_objects, save
from rhot.files.capture import write_lines
from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, angle_between, apply
from services.cli.calibrate.calibrate import calibrate
from services.recorder.recorder import Recorder
from testing.painted_tracker import MARKER_M, PaintedTracker, rows_of
from testing.synthetic_points import START_NS


def run(rig_toml: Path, *words: object) -> Result:
    return CliRunner().invoke(calibrate, ["objects", *map(str, words), "--config", str(rig_toml)])


def refusal(rig_toml: Path, *words: object) -> str:
    """What it says, having written nothing."""
    path = rig_toml.parent / "calibration" / "objects.json"
    before = path.read_bytes() if path.exists() else None
    result = run(rig_toml, *words)
    assert isinstance(result.exception, CalibrationError | CaptureError), result.output
    assert (path.read_bytes() if path.exists() else None) == before
    return str(result.exception)


def error_m(T: Array, scene: PaintedTracker) -> float:
    """The largest error of the registration over the scene's volume."""
    at = np.array([scene.truth(t_s)[:3, 3] for t_s in range(20)])
    in_lighthouse = apply(np.linalg.inv(scene.T_rig_from_lighthouse), at)
    return float(np.linalg.norm(apply(T, in_lighthouse) - at, axis=1).max())


def test_a_recording_registers_the_cup_and_keeps_the_pen(
    rig_toml: Path, recording: Path, scene: PaintedTracker
) -> None:
    pen = ObjectPlace(offset_m=(0.0, 0.0, 0.1), time_offset_ns=7, marker_m=(0.0, 0.01, 0.0))
    cup = ObjectPlace(offset_m=(0.0, 0.05, 0.0))
    path = rig_toml.parent / "calibration" / "objects.json"
    save(path, Objects(T_rig_from_lighthouse=rows_of(np.eye(4)), objects={"pen": pen, "cup": cup}))
    result = run(rig_toml, "--recording", recording)
    assert result.exit_code == 0, result.output
    for said in ("registered cup", "held-out seconds", "30.", "ms late", f"written: {path}"):
        assert said in result.output
    made = load_objects(path.parent)
    assert made.objects["pen"] == pen
    found = made.objects["cup"]
    assert found.offset_m == cup.offset_m
    assert found.time_offset_ns == pytest.approx(30e6, abs=1e6)
    assert found.marker_m == pytest.approx(MARKER_M, abs=0.001)
    T = np.array(made.T_rig_from_lighthouse)
    assert error_m(T, scene) < 0.001
    assert angle_between(T[:3, :3], scene.T_rig_from_lighthouse[:3, :3]) < np.deg2rad(0.15)
    assert made.universe == "one"
    assert 0.0 < made.sigma_m < 0.001
    assert made.residuals["held_out_mm"] < 1.5
    assert np.shape(made.residuals["covariance"]) == (6, 6)


def test_an_mcap_gives_the_same_and_json_is_the_file(
    rig_toml: Path, tmp_path: Path, scene: PaintedTracker
) -> None:
    recorder = Recorder(RigConfig(), tmp_path)
    path = recorder.start(START_NS)
    arrivals = [(pose.stamp_ns, topics.OPENVR, {"serial": "LHR-1"}, pose) for pose in scene.poses()]
    arrivals += [
        (frame.stamp_ns, topics.MARKERS, {"camera": frame.camera}, frame)
        for frame in scene.frames()
    ]
    for stamp_ns, topic, names, message in sorted(arrivals, key=lambda one: one[0]):
        recorder.add(topic, topic.key("desk", **names), msgspec.json.encode(message), stamp_ns)
    recorder.stop()
    result = run(rig_toml, "--recording", path, "--json", "--dry-run")
    assert result.exit_code == 0, result.output
    made = msgspec.json.decode(result.stdout, type=Objects)
    assert error_m(np.array(made.T_rig_from_lighthouse), scene) < 0.001
    # The pen was never registered by paint of its own: the delay is that of the same SteamVR.
    assert made.objects["pen"].time_offset_ns == made.objects["cup"].time_offset_ns
    assert not (rig_toml.parent / "calibration" / "objects.json").exists()


def test_weak_data_is_refused_with_the_reason(
    rig_toml: Path, tmp_path: Path, scene: PaintedTracker
) -> None:
    for motion, reason in (
        (replace(scene, turn_rad=0.0), "turned"),
        (replace(scene, seconds=4.0), "20 s"),
        (scene.at_rest(), "turned|moved"),
    ):
        folder = tmp_path / "weak"
        folder.mkdir(exist_ok=True)
        write_lines(folder / "markers.jsonl", motion.frames())
        write_lines(folder / "objects.jsonl", motion.poses())
        said = refusal(rig_toml, "--recording", folder)
        assert any(word in said for word in reason.split("|")), said


def test_what_is_wrong_with_options_and_files(rig_toml: Path, recording: Path) -> None:
    with_it = ("--recording", recording)
    assert "did you mean 'cup'" in refusal(rig_toml, "cupp", *with_it)
    assert "has no paint" in refusal(rig_toml, "pen", *with_it)
    assert "no camera saw 'green' paint" in refusal(rig_toml, "cup", "--marker", "green", *with_it)
    assert "say of which object" in refusal(rig_toml, "--marker", "green", *with_it)
    assert "register first" in refusal(rig_toml, "--place-only", "--offset", "cup=0,0,0")
    assert "no objects.json to check" in refusal(rig_toml, "--check", *with_it)
    assert "is no capture" in refusal(rig_toml, "--recording", recording.parent / "calibration")
    assert "--points needs --poses" in refusal(rig_toml, "cup", "--points", rig_toml)
    (recording / "objects.jsonl").write_text('{"object":"cup"}\n')
    assert "as SteamVR reports them" in refusal(rig_toml, *with_it)
    (recording / "objects.jsonl").unlink()
    assert "no such file" in refusal(rig_toml, *with_it)


def test_a_color_of_the_hand_is_allowed_and_said(rig_toml: Path, recording: Path) -> None:
    result = run(rig_toml, "cup", "--marker", "blue", "--recording", recording)
    assert "blue is also the right hand's index tip" in result.stderr


def test_places_are_written_without_registering(rig_toml: Path) -> None:
    path = rig_toml.parent / "calibration" / "objects.json"
    before = Objects(T_rig_from_lighthouse=rows_of(np.eye(4)), date="then", universe="one")
    save(path, before)
    words = ["--place-only", "--offset", "cup=0,0.01,-0.05", "--turn", "cup=90,0,90"]
    result = run(rig_toml, *words)
    assert result.exit_code == 0, result.output
    made = load_objects(path.parent)
    assert msgspec.structs.replace(made, objects={}) == before
    place = made.objects["cup"]
    assert place.offset_m == (0.0, 0.01, -0.05)
    # About x first, then about z: the object's y points along the tracker's z, its x along y.
    assert place.orientation_wxyz == pytest.approx((0.5, 0.5, 0.5, 0.5), abs=1e-6)
    assert "say of which object" in refusal(rig_toml, "--place-only", "--offset", "0,0,0")
    assert "give metres" in refusal(rig_toml, "--place-only", "--offset", "cup=10,0,0")
    for wrong in ("cup=1,2", "cup=a,b,c", "cup=nan,0,0", "cup"):
        assert "[NAME=]X,Y,Z" in refusal(rig_toml, "--place-only", "--turn", wrong)


def test_check_measures_and_changes_nothing(
    rig_toml: Path, recording: Path, scene: PaintedTracker, tmp_path: Path
) -> None:
    assert run(rig_toml, "--recording", recording).exit_code == 0
    path = rig_toml.parent / "calibration" / "objects.json"
    written = path.read_bytes()
    well = run(rig_toml, "--recording", recording, "--check")
    assert "That is well." in well.output
    moved = np.eye(4)
    moved[:3, 3] = (0.0, 0.006, 0.0)
    write_lines(recording / "objects.jsonl", scene.poses(T_moved=moved))
    told = run(rig_toml, "--recording", recording, "--check", "--json")
    found = msgspec.json.decode(told.stdout)[0]
    assert found["distance_mm"] == pytest.approx(6.0, abs=0.6)
    assert found["shift_mm"][1] == pytest.approx(-6.0, abs=0.6)
    assert path.read_bytes() == written
    other = replace(scene, universe="two")
    write_lines(recording / "objects.jsonl", other.poses())
    assert (
        "universe two: register again" in run(rig_toml, "--recording", recording, "--check").output
    )


@pytest.mark.parametrize("stamped", [False, True])
def test_points_that_were_measured_by_other_means(
    rig_toml: Path, tmp_path: Path, scene: PaintedTracker, stamped: bool
) -> None:
    still = replace(scene, outliers=0.0, tracker_m=0.0, tracker_rad=0.0, time_offset_s=0.0)
    poses = list(still.poses())[::40]
    rows = []
    for pose in poses:
        x, y, z = apply(still.truth((pose.stamp_ns - START_NS) * 1e-9), MARKER_M)
        rows.append((f"{pose.stamp_ns}," if stamped else "") + f"{x:.6f},{y:.6f},{z:.6f}")
    points, poses_file = tmp_path / "points.csv", tmp_path / "poses.jsonl"
    points.write_text("\n".join(["stamp_ns,x,y,z" if stamped else "x,y,z", *rows]) + "\n")
    write_lines(poses_file, poses)
    result = run(rig_toml, "cup", "--points", points, "--poses", poses_file)
    assert result.exit_code == 0, result.output
    assert f"from {len(poses)} points: 0.00 mm RMS" in result.output
    made = load_objects(rig_toml.parent / "calibration")
    assert error_m(np.array(made.T_rig_from_lighthouse), scene) < 1e-5
    points.write_text("\n".join([*rows[:-1], "1,2,drei"]))
    assert "is not x,y,z in metres" in refusal(
        rig_toml, "cup", "--points", points, "--poses", poses_file
    )
    if not stamped:
        points.write_text("\n".join(rows[:-1]))
        assert "give as many" in refusal(rig_toml, "cup", "--points", points, "--poses", poses_file)
