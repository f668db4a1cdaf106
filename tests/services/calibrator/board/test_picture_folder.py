"""Names of picture files: which camera, which position."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.board.picture_folder import (
    find_pictures,
    one_camera,
    picture_of,
    read_grey,
    side_by_side,
    split_side_by_side,
)


@pytest.fixture
def folder(tmp_path):
    """A function that makes empty files of these names in a new folder."""

    def make(*names: str):
        for name in names:
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        return tmp_path

    return make


def names_of(pattern: str, cameras: tuple[str, ...], count: int = 4) -> list[str]:
    return [pattern.format(camera=camera, n=n) for camera in cameras for n in range(1, count + 1)]


@pytest.mark.parametrize(
    ("pattern", "given", "found"),
    [
        ("{camera}{n:02d}.jpg", ("right", "left"), ["left", "right"]),
        ("{camera}_{n}.png", ("left", "right"), ["left", "right"]),
        ("{n:03d}-{camera}.PNG", ("left", "right"), ["left", "right"]),
        ("{camera}/{n}.png", ("left", "right"), ["left", "right"]),
        ("{camera}/{camera}{n:02d}.png", ("left", "right"), ["left", "right"]),
        ("{camera}/img_{n:02d}.jpeg", ("cam0", "cam1", "cam2"), ["cam0", "cam1", "cam2"]),
        ("cam{camera}_{n}.png", ("0", "1"), ["cam0", "cam1"]),
        ("img{camera}{n}.png", ("L", "R"), ["imgL", "imgR"]),
        ("2024-05-01_{camera}_{n:04d}.png", ("pi", "zero"), ["pi", "zero"]),
        ("{camera}_{n}.png", ("0", "1"), ["0", "1"]),
    ],
)
def test_cameras_and_positions_are_found_out(folder, pattern, given, found):
    pictures = find_pictures(folder(*names_of(pattern, given)))
    assert pictures.cameras == found
    assert all(len(files) == 4 for files in pictures.files.values())
    assert len(pictures.positions()) == 4
    assert not pictures.left_out


def test_pairs_belong_together_whatever_the_zeros(folder):
    pictures = find_pictures(
        folder("left01.png", "left02.png", "left10.png", "right1.png", "right2.png", "right10.png")
    )
    assert pictures.positions() == ["1", "2", "10"]
    assert pictures.files["right"]["10"].name == "right10.png"


def test_pictures_named_by_time_are_paired_in_their_order(folder):
    pictures = find_pictures(
        folder(
            "left/100.png",
            "left/205.png",
            "left/310.png",
            "right/101.png",
            "right/206.png",
            "right/311.png",
        )
    )
    assert [pictures.files["right"][key].name for key in pictures.positions()] == [
        "101.png",
        "206.png",
        "311.png",
    ]
    uneven = find_pictures(folder("left/415.png"))
    assert not set(uneven.files["left"]) & set(uneven.files["right"])


def test_other_pictures_are_listed_and_a_missing_partner_is_no_error(folder):
    pictures = find_pictures(
        folder(
            *names_of("{camera}{n}.png", ("left", "right")), "left7.png", "result.png", "readme.txt"
        )
    )
    assert set(pictures.files["left"]) - set(pictures.files["right"]) == {"7"}
    assert [path.name for path in pictures.left_out] == ["result.png"]


def test_named_cameras_come_in_the_order_they_are_named(folder):
    made = folder(*names_of("{camera}_{n}.png", ("a", "b", "c")))
    assert find_pictures(made, ["c", "a"]).cameras == ["c", "a"]
    with pytest.raises(CalibrationError, match="cannot tell pictures of a and x apart"):
        find_pictures(made, ["a", "x"])


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        ((), "holds no pictures"),
        (("notes.txt",), "holds no pictures"),
        (("a.png", "b1.jpg"), "left01.png and right01.png"),
    ],
)
def test_folders_that_say_nothing_are_refused(folder, names, reason):
    with pytest.raises(CalibrationError, match=reason):
        find_pictures(folder(*names))


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(CalibrationError, match="no such folder"):
        find_pictures(tmp_path / "nowhere")


def test_one_camera_takes_its_own_pictures_or_all(folder):
    made = folder(*names_of("{camera}{n}.png", ("left", "right")))
    assert len(one_camera(made, "left").files["left"]) == 4
    assert len(one_camera(made, "other").files["other"]) == 8
    assert picture_of(made, "right").name == "right1.png"
    assert picture_of(made, "third") is None


def test_pictures_side_by_side_are_cut(tmp_path):
    image = np.concatenate(
        [np.full((4, 6), 10, dtype=np.uint8), np.full((4, 6), 200, dtype=np.uint8)], axis=1
    )
    cv2.imwrite(str(tmp_path / "scene_1.png"), image)
    pictures = side_by_side(tmp_path, ["left", "right"])
    assert pictures.read("left", "scene_1").tolist() == np.full((4, 6), 10).tolist()
    assert pictures.read("right", "scene_1").mean() == 200
    with pytest.raises(CalibrationError, match="cannot be 5 equal"):
        split_side_by_side(image, 5)
    with pytest.raises(CalibrationError, match="two cameras"):
        side_by_side(tmp_path, ["left"])


def test_pictures_as_wide_as_two_need_no_option(tmp_path):
    for n in range(1, 4):
        cv2.imwrite(
            str(tmp_path / f"scene_1280x480_{n}.png"), np.full((48, 128), n, dtype=np.uint8)
        )
    pictures = find_pictures(tmp_path)
    assert pictures.side_by_side
    assert pictures.cameras == ["left", "right"]
    assert len(pictures.positions()) == 3
    assert pictures.read("right", pictures.positions()[0]).shape == (48, 64)


def test_a_series_of_one_camera_is_no_rig(tmp_path):
    for n in range(1, 6):
        cv2.imwrite(str(tmp_path / f"left_{n}.png"), np.full((48, 64), n, dtype=np.uint8))
    with pytest.raises(CalibrationError, match="cannot tell pictures apart"):
        find_pictures(tmp_path)


def test_a_file_that_is_no_picture_is_named(tmp_path):
    (tmp_path / "left1.png").write_text("not a picture")
    with pytest.raises(CalibrationError, match=r"left1\.png: is not a picture"):
        read_grey(tmp_path / "left1.png")
