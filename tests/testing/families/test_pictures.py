"""Cases of pictures: markers lie at the truth, disk gives the same, the halves differ."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from testing.families import marker_cache, pictures
from testing.families.case import HALVES
from testing.families.catalog import cases
from testing.families.people import PaintJob, Person
from testing.families.picture_catalog import recipes
from testing.families.pictures import Recipe, picture_case
from testing.synthetic_points import START_NS

SHORT = Recipe(
    person=Person(0.9, seed=3),
    paint=PaintJob((9.0, 18.0), dab_off_mm=5.0, uneven=0.3, seed=3),
    given_scale=1.0,
    seconds=0.4,
    seed=7,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def case(folder, monkeypatch):
    monkeypatch.setattr(marker_cache, "cache_root", lambda: folder)
    return picture_case("short", SHORT)


def test_markers_are_where_the_truth_is_projected(case):
    colors = case.config.hand["right"].markers
    found = 0
    for frame, shares in zip(case.frames, case.visible, strict=True):
        camera = case.cameras[frame.camera]
        late_s = (case.clock_errors_s or {})[frame.camera]
        begin_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9 - late_s
        seen = {marker.color: marker for marker in frame.markers}
        for column, landmark in enumerate(case.landmarks):
            marker = seen.get(colors[landmark])
            if marker is None or shares[column] < 0.9:
                continue
            at_s = begin_s + marker.y_px * frame.row_time_ns * 1e-9
            expected = camera.project(case.truth(np.array([at_s]))[0, column])[0]
            # The middle of what is visible lies beside the middle of the bone's painted part: by
            # some 4 mm at half a metre, 1 px a millimetre.
            assert np.abs(np.subtract((marker.x_px, marker.y_px), expected)).max() < 5.0
            found += 1
    assert found > 100


def test_the_given_hand_is_not_the_painted_one(case):
    given, true = case.hands["right"], SHORT.hand()
    assert given.origin == "tables"
    assert np.abs(given.lengths_m / true.lengths_m - 1.0).max() > 0.1
    assert given.paint["index_tip"].extent_m != true.paint["index_tip"].extent_m
    assert np.linalg.norm(np.subtract(true.paint["wrist"].offset_m, (0, -0.0189, 0))) == (
        pytest.approx(0.005, abs=1e-4)
    )


def test_a_second_time_comes_from_disk_and_is_the_same(case, monkeypatch):
    def never(*_given):
        raise AssertionError("rendered again")

    monkeypatch.setattr(pictures, "detected", never)
    monkeypatch.setattr(pictures, "visible_shares", never)
    again = picture_case("short", SHORT)
    assert again.frames == case.frames
    assert np.array_equal(again.visible, case.visible)
    with pytest.raises(AssertionError, match="rendered again"):
        picture_case("short", dataclasses.replace(SHORT, seed=8))


def test_a_damaged_file_is_made_again(folder, monkeypatch):
    monkeypatch.setattr(marker_cache, "cache_root", lambda: folder / "damaged")
    made = iter(("first", "second", "third"))

    def keep(recipe):
        return marker_cache.kept("word", recipe, lambda: next(made), tracker=False)

    for expected in ("first", "first"):
        assert keep(1) == expected
    for path in (folder / "damaged" / "families").iterdir():
        path.write_bytes(b"no such thing")
    assert keep(1) == "second"
    assert keep(2) == "third"


def test_the_digest_covers_what_is_imported():
    assert marker_cache.code_digest(tracker=True) != marker_cache.code_digest(tracker=False)


def test_the_halves_share_no_case():
    names = {half: {(s.family, s.name) for s in cases(half, "pictures")} for half in HALVES}
    assert {f for f, _ in names["tuning"]} == {f for f, _ in names["held_out"]}
    tuning, held_out = (recipes(half).values() for half in HALVES)
    assert not set(tuning) & set(held_out)
    assert not {r.seed for r in tuning} & {r.seed for r in held_out}
    skins = [{r.person.seed for r in each if r.person.bones} for each in (tuning, held_out)]
    assert not skins[0] & skins[1]
