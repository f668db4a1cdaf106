"""A Vive tracker against a laser tracker: real, and folders that are otherwise."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.objects.laser_points import read_experiment, register_laser


@pytest.fixture
def marvin(rhot_data):
    """The experiment of 2020-08-27."""
    folder = rhot_data / "vive" / "marvin" / "20200827_Exp1"
    if not folder.is_dir():
        pytest.skip(f"no {folder}; set RHOT_DATA to the folder of real recordings")
    return folder


def test_a_vive_tracker_leaves_under_six_millimetres_against_a_laser_tracker(marvin):
    """5.646 mm with plain numpy as well: the rest is the lighthouses' own."""
    experiment = read_experiment(marvin)
    assert experiment.again.sum() == len(experiment.poses) == 11
    found = register_laser(experiment)
    assert 1e3 * found.rms_m <= 5.7
    assert 1e3 * np.linalg.norm(found.residuals_m, axis=1).max() < 12.0


def test_a_place_that_only_one_of_both_measured_is_left_out(marvin, tmp_path):
    folder = tmp_path / "experiment"
    shutil.copytree(marvin, folder)
    (folder / "measurementPoint4.txt").unlink()
    experiment = read_experiment(folder)
    assert (experiment.again.sum(), len(experiment.poses)) == (11, 10)
    assert 1e3 * register_laser(experiment).rms_m < 6.0


def test_matrices_and_other_names_are_read_as_well(marvin, tmp_path):
    experiment = read_experiment(marvin)
    shutil.copy(marvin / "20200827_Exp1_laserData.csv", tmp_path / "leica.csv")
    for number, pose in enumerate(experiment.poses, start=1):
        row = " ".join(repr(float(value)) for value in pose[:3].reshape(-1))
        (tmp_path / f"place_{number:03d}.txt").write_text(f"# 3x4 rows\n{row}\n{row}\nno pose\n")
    found = register_laser(read_experiment(tmp_path))
    assert found.rms_m == pytest.approx(register_laser(experiment).rms_m, abs=1e-9)


def test_points_in_another_order_without_the_last_and_with_home_positions_between(marvin, tmp_path):
    """As in the experiment of 2020-07-17: x, y, origin; rows of the laser's home position."""
    experiment = read_experiment(marvin)
    shutil.copytree(marvin, tmp_path / "again")
    table = tmp_path / "again" / "20200827_Exp1_laserData.csv"
    header, *rows = table.read_text().splitlines()
    written = [header]
    for i in range(5, len(rows), 4):
        written += [rows[i + 1], rows[i + 2], rows[i], "-1369.5100,-956.0230,147.1770,0,0,0,"]
    table.write_text("\n".join(written))
    table.rename(table.with_suffix(".txt"))
    found = read_experiment(tmp_path / "again")
    assert len(found.points_m) == 11
    assert not found.again.any()
    assert register_laser(found).rms_m == pytest.approx(register_laser(experiment).rms_m, abs=1e-5)


def test_folders_without_a_laser_or_without_poses_are_told(marvin, tmp_path):
    with pytest.raises(CalibrationError, match="no table of a laser"):
        read_experiment(tmp_path)
    shutil.copy(marvin / "20200827_Exp1_laserData.csv", tmp_path / "laser.csv")
    with pytest.raises(CalibrationError, match=r"\.\.\.1\.txt"):
        read_experiment(tmp_path)
