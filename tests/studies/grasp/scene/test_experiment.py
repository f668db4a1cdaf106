"""A rendered experiment: what it says it shows is where it says."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import ConfigError
from studies.grasp.scene.backdrop import Rectangle
from studies.grasp.scene.experiment import Experiment, Options
from studies.grasp.scene.motion import Cycles, perform
from studies.grasp.scene.subjects import SUBJECTS, chain, subject_named
from studies.grasp.scene.truth import pixel_table, scene_file, seeds_of, truth_of
from studies.grasp.scene.view import ViewOptions

SMALL = ViewOptions((320, 240))
SHORT = Cycles(number=2, period_s=1.2, fps=15.0)


@pytest.fixture(scope="module")
def pinch():
    options = Options(view=SMALL, cycles=SHORT, dots="blue", thumb=True, noise=1.0)
    return Experiment(SUBJECTS[1], options, seed=3)


def blue_centres(picture, near, radius=5):
    """Centroid of what is bluer than skin about each of some pixels (n, 2)."""
    blue = picture[..., 0].astype(float) - picture[..., 2]
    found = []
    for x, y in np.round(near).astype(int):
        box = np.clip(blue[y - radius : y + radius + 1, x - radius : x + radius + 1], 0, None)
        weight = np.where(box > 0.4 * box.max(), box, 0.0)
        rows, columns = np.mgrid[-radius : radius + 1, -radius : radius + 1]
        found.append(
            (x + (weight * columns).sum() / weight.sum(), y + (weight * rows).sum() / weight.sum())
        )
    return np.array(found)


def test_dots_are_seen_where_the_truth_has_them(pinch):
    """Through lens, tilt, sway and noise; the thumb's tip in front of the finger's."""
    for frame in (0, 8):
        names = seeds_of(pinch)
        assert len(names) == 8
        truth = np.array([pinch.pixels_of(frame)[name] for name in names])
        found = blue_centres(pinch.picture(frame), truth)
        assert np.hypot(*(found - truth).T).max() < 0.6


def test_a_hand_from_the_right_has_the_same_angles(pinch):
    turned = Experiment(pinch.subject, pinch.options._replace(mirrored=True), seed=3)
    truth = np.array([turned.pixels_of(4)[name] for name in ("mcp", "pip", "dip", "tip")])
    assert truth[0, 0] > truth[1, 0]
    assert np.hypot(*(blue_centres(turned.picture(4), truth) - truth).T).max() < 0.6
    assert truth_of(turned)[0] == truth_of(pinch)[0]


def test_the_same_seed_gives_the_same_picture_and_another_one_does_not(pinch):
    again = Experiment(pinch.subject, pinch.options, seed=3)
    assert np.array_equal(again.picture(5), pinch.picture(5))
    other = Experiment(pinch.subject, pinch.options, seed=4)
    assert not np.array_equal(other.picture(5), pinch.picture(5))
    assert truth_of(other) != truth_of(pinch)


def test_the_truth_is_a_chain_of_the_subjects_bones(pinch):
    index, thumb = truth_of(pinch)
    assert (index.finger, thumb.finger) == ("index", "thumb")
    assert index.lengths == pinch.subject.lengths
    assert len(index.frames) == len(pinch)
    for frame in index.frames[::7]:
        angles = np.array([frame.angles_rad[name] for name in ("mcp", "pip", "dip")])
        assert np.allclose(chain(index.lengths, angles, (0.0, 0.0)), list(frame.points.values()))
        assert frame.tip_direction_rad == pytest.approx(angles.sum())
    assert len(pixel_table(pinch).splitlines()) == len(pinch) + 1


def test_cycles_close_fists_by_each_subjects_own_law():
    for subject in SUBJECTS:
        motion = perform(subject, Cycles(number=5, fps=10.0), seed=8)
        assert set(motion.cycle) == {0, 1, 2, 3, 4}
        # The tremor of DIP is its own: 0.6 deg RMS.
        off = motion.angles[:, 2] - subject.law.dip(motion.angles[:, 1])
        assert np.degrees(np.abs(off)).max() < 2.5
        top = np.degrees(motion.angles.max(axis=0))
        assert np.abs(top[:2] - subject.closed_deg).max() < 8.0
        for cycle in range(5):
            closing = (motion.cycle == cycle) & motion.closing.astype(bool)
            # Of 2 s, at a pace that varies.
            assert 17 <= closing.sum() <= 23


def test_the_scene_says_where_the_rectangle_is(pinch):
    """Its homography takes mm to pixels of a picture without distortion."""
    scene = scene_file(pinch)
    mm = np.array(scene.reference.corners_mm)
    H = np.array(scene.homography)
    ideal = np.c_[mm, np.ones(4)] @ H.T
    camera = pinch.view.camera
    flat = ideal[:, :2] / ideal[:, 2:]
    rays = (flat - camera.matrix[:2, 2]) / camera.matrix[0, 0]
    assert np.allclose(camera.pixels_from_rays(rays), scene.reference.corners_px, atol=2e-3)
    # Dark ink inside the corner, white card outside.
    picture = pinch.picture(0).mean(axis=-1)
    middle = mm.mean(axis=0)
    for corner in mm:
        towards = np.sign(middle - corner)
        (xi, yi), (xo, yo) = np.round(
            pinch.view.pixels([corner + 2.0 * towards, corner - 3.0 * towards])
        ).astype(int)
        assert picture[yi, xi] + 60 < picture[yo, xo]


def test_a_rectangle_behind_is_seen_smaller():
    options = Options(view=SMALL._replace(tilt_deg=0.0), cycles=SHORT)
    near = scene_file(Experiment(SUBJECTS[0], options, 1)).reference
    behind = options._replace(rectangle=Rectangle(z=30.0))
    far = scene_file(Experiment(SUBJECTS[0], behind, 1)).reference
    width = [np.ptp(np.array(one.corners_px)[:, 0]) for one in (near, far)]
    assert 0.88 < width[1] / width[0] < 0.93


def test_an_unknown_subject_is_told_the_known_ones():
    assert subject_named("4") is subject_named("subject-4")
    with pytest.raises(ConfigError, match="subject-1, subject-2"):
        subject_named("me")


def test_no_limb_is_cut_off_by_its_box_however_the_camera_stands():
    for tilt in (0.0, 35.0):
        view = SMALL._replace(tilt_deg=tilt)
        shown = Experiment(SUBJECTS[2], Options(view=view, cycles=SHORT, thumb=tilt > 0.0), 20)
        for frame in (0, 9):
            for (rows, columns), _, share in shown.hand(frame):
                inside = (rows.start > 0, rows.stop < 240, columns.start > 0, columns.stop < 320)
                sides = (share[0], share[-1], share[:, 0], share[:, -1])
                for side, within in zip(sides, inside, strict=True):
                    assert not within or side.max() < 0.02
