"""Background subtraction: static things are left out, what moves before them is found."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.rig_tables import Tracker
from services.pi_tracker.identify.background import BackgroundModel
from services.pi_tracker.image.blob import make_blob
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import picture
from services.pi_tracker.step import TrackerStep

FRAME_NS = 33_333_333
THING, MARKER, WALL = (110, 150, 180), (160, 150, 190), (140, 128, 128)


def shot(seq, *patches, size=(120, 90), sigma=1.4):
    """A wall with patches (rect in cells, Y U V), with noise of so many grey levels a cell."""
    rng = np.random.default_rng(seq)
    cells = np.empty((size[1], size[0], 3))
    cells[:] = WALL
    for (x0, y0, x1, y1), color in patches:
        cells[y0:y1, x0:x1] = color
    y, u, v = np.moveaxis(
        np.clip(np.rint(cells + rng.normal(0, sigma, cells.shape)), 0, 255).astype(np.uint8), 2, 0
    )
    size_px = (2 * size[0], 2 * size[1])
    i420 = np.concatenate([y.repeat(2, 0).repeat(2, 1).ravel(), u.ravel(), v.ravel()]).reshape(
        3 * size[1], size_px[0]
    )
    return picture(Frame("left", seq, 0, 0.0, size_px, i420, "i420"))


def blob(rect, mask=None):
    x0, y0, x1, y1 = rect
    mask = np.full((y1 - y0, x1 - x0), 255, np.uint8) if mask is None else mask
    return make_blob(0, rect, mask, int(np.count_nonzero(mask)))


def learn(model, noise, *things, count=5, first=0, markers=()):
    """Show things so many times, 30 times a second."""
    for seq in range(first, first + count):
        image = shot(seq, *((rect, THING) for rect in things))
        model.update(
            image,
            (0, 0, *image.size),
            [blob(rect) for rect in things],
            markers,
            noise,
            (1 + seq) * FRAME_NS,
        )


def rects(blobs):
    """Rectangles of blobs."""
    return [one.rect for one in blobs]


def foreground(model, image, blobs, noise):
    """Rectangles of the foreground."""
    return rects(model.foreground(image, blobs, noise))


def test_a_thing_is_left_out_after_a_few_sightings(noise):
    model, rect = BackgroundModel(), (20, 20, 40, 44)
    learn(model, noise, rect, count=3)
    image = shot(50, (rect, THING))
    assert foreground(model, image, [blob(rect)], noise) == rects([blob(rect)])
    learn(model, noise, rect, count=2, first=3)
    assert model.foreground(image, [blob(rect)], noise) == []
    # A part of it, where a hand is before the rest, is background, too.
    assert model.foreground(image, [blob((20, 20, 30, 30))], noise) == []
    elsewhere = blob((60, 20, 80, 44))
    assert foreground(model, image, [elsewhere], noise) == rects([elsewhere])


def test_a_marker_before_a_thing_and_beside_it_is_cut_out(noise):
    model, rect = BackgroundModel(), (20, 20, 40, 44)
    learn(model, noise, rect)
    for place in ((36, 30, 43, 37), (26, 28, 33, 35)):
        image = shot(60, (rect, THING), (place, MARKER))
        merged = (20, 20, max(place[2], 40), 44)
        mask = np.zeros((24, merged[2] - 20), np.uint8)
        mask[:, :20] = 255
        mask[place[1] - 20 : place[3] - 20, place[0] - 20 : place[2] - 20] = 255
        (part,) = model.foreground(image, [blob(merged, mask)], noise)
        assert max(abs(np.subtract(part.rect, place))) <= 1
        assert part.cells == pytest.approx(49, abs=8)
        assert (part.x_px, part.y_px) == pytest.approx(
            (place[0] + place[2] - 0.5, place[1] + place[3] - 0.5), abs=2.0
        )


def test_markers_and_their_rims_are_not_learnt(noise):
    model, rect = BackgroundModel(), (20, 20, 30, 30)
    learn(model, noise, rect, (32, 20, 34, 30), count=8, markers=[rect])
    image = shot(70, (rect, THING))
    assert foreground(model, image, [blob(rect), blob((32, 20, 34, 30))], noise) == rects(
        [blob(rect), blob((32, 20, 34, 30))]
    )


def test_cells_that_noise_moves_in_and_out_of_a_colour_are_learnt(noise):
    """Half of the cells are within the range in each frame, other ones in each."""
    model, rect, rng = BackgroundModel(), (20, 20, 40, 44), np.random.default_rng(3)
    for seq in range(12):
        mask = np.where(rng.random((24, 20)) < 0.5, np.uint8(255), np.uint8(0))
        image = shot(seq, (rect, THING))
        region = (0, 0, *image.size)
        model.update(image, region, [blob(rect, mask)], [], noise, (1 + seq) * FRAME_NS)
    assert model.foreground(shot(20, (rect, THING)), [blob(rect)], noise) == []


@pytest.mark.parametrize(
    ("uncovered", "known"), [((40, 20, 52, 44), True), ((40, 20, 70, 44), False)]
)
def test_what_a_hand_uncovers_of_a_known_thing_is_known_at_once(noise, uncovered, known):
    """But not where more of it would be uncovered than was known."""
    model, seen = BackgroundModel(), (20, 20, 40, 44)
    learn(model, noise, seen)
    whole = (20, 20, uncovered[2], 44)
    found = foreground(model, shot(50, (whole, THING)), [blob(whole)], noise)
    assert found == ([] if known else [uncovered])


def test_a_marker_beside_what_is_uncovered_is_no_part_of_it(noise):
    model, seen = BackgroundModel(), (20, 20, 40, 44)
    learn(model, noise, seen)
    image = shot(50, ((20, 20, 48, 44), THING), ((44, 28, 51, 35), MARKER))
    mask = np.zeros((24, 31), np.uint8)
    mask[:, :28] = 255
    mask[8:15, 24:31] = 255
    (part,) = model.foreground(image, [blob((20, 20, 51, 44), mask)], noise)
    assert max(abs(np.subtract(part.rect, (44, 28, 51, 35)))) <= 1


def test_what_has_the_colour_of_known_things_nearby_resembles_them(noise):
    model, seen = BackgroundModel(), (20, 20, 40, 44)
    piece, marker, far = (46, 20, 54, 40), (20, 50, 27, 57), (100, 70, 108, 80)
    image = shot(50, (seen, THING), (piece, THING), (marker, MARKER), (far, THING))
    assert not model.resembles(image, blob(piece), noise)
    learn(model, noise, seen)
    assert model.resembles(image, blob(piece), noise)
    assert not model.resembles(image, blob(marker), noise)
    assert not model.resembles(image, blob(far), noise)
    # More than the known thing could be another one.
    assert not model.resembles(image, blob((42, 2, 90, 60)), noise)


def test_in_a_dim_room_a_marker_is_not_taken_for_the_wall_behind_it():
    """Noise gives specks of the wall a paint's colour, and they are learnt."""
    model, dim = BackgroundModel(), Noise(luma=6.0, chroma=6.0)
    wall, marker = (10, 10, 60, 60), (30, 30, 39, 39)
    for seq in range(8):
        image = shot(seq, sigma=6.0)
        model.update(image, (0, 0, *image.size), [blob(wall)], [], dim, (1 + seq) * FRAME_NS)
    image = shot(50, (marker, (140, 100, 128)), sigma=6.0)
    (found,) = model.foreground(image, [blob(marker)], dim)
    assert found.cells >= 75
    assert model.foreground(image, [blob((45, 30, 54, 39))], dim) == []
    assert not model.resembles(image, blob(marker), dim)


def test_what_passes_again_and_again_is_not_static(noise):
    model, rect = BackgroundModel(), (20, 20, 30, 30)
    for round_ in range(6):
        learn(model, noise, rect, count=2, first=4 * round_)
        learn(model, noise, (60, 60, 70, 70), count=2, first=4 * round_ + 2)
    image = shot(71, (rect, THING))
    assert foreground(model, image, [blob(rect)], noise) == rects([blob(rect)])


def test_a_thing_taken_away_is_forgotten_and_other_light_learnt_anew(noise):
    model, rect = BackgroundModel(), (20, 20, 40, 44)
    learn(model, noise, rect)
    image = shot(80, (rect, THING))
    learn(model, noise, count=1, first=1000)
    learn(model, noise, count=1, first=2000)
    assert foreground(model, image, [blob(rect)], noise) == rects([blob(rect)])
    dim = shot(81, (rect, (80, 145, 165)))
    learn(model, noise, rect, first=2001)
    assert foreground(model, dim, [blob(rect)], noise) == rects([blob(rect)])
    for seq in range(3000, 3012):
        model.update(dim, (0, 0, *dim.size), [blob(rect)], [], noise, seq * FRAME_NS)
    assert model.foreground(dim, [blob(rect)], noise) == []


def test_another_size_starts_a_new_model_and_clocks_may_jump(noise):
    model, rect = BackgroundModel(), (20, 20, 40, 44)
    learn(model, noise, rect)
    small = shot(1, size=(60, 50))
    assert foreground(model, small, [blob(rect)], noise) == rects([blob(rect)])
    for stamp_ns in (5, 2**62, 0):
        model.update(small, (0, 0, 60, 50), [blob(rect)], [], Noise(), stamp_ns)


def test_the_tracker_follows_a_marker_across_a_thing_of_its_colour(studio, tip, colors):
    """A dull green box is in the background; a brighter green tip crosses it beside a blue one."""
    size, found = (180, 100), []
    background = np.full((100, 180, 3), studio.clean([], (8, 8))[0][0, 0], np.float32)
    background[25:75, 70:110] = 0.6 * np.array(studio.paints["green"])
    tips = [
        tip("green", 30.0, 52.0, width_px=13.0, length_px=14.0),
        tip("blue", 30.0, 25.0, width_px=13.0, length_px=14.0),
    ]
    hand, truth = studio.clean(tips, (60, 100))
    wall, _ = studio.clean([], (60, 100))
    is_hand = np.abs(hand - wall).max(axis=2, keepdims=True) > 6.0
    step = TrackerStep("left", colors, Tracker(), size, ["green", "blue"])
    for seq in range(26):
        left, image = 5 * max(seq - 5, 0), background.copy()
        image[:, left : left + 60] = np.where(is_hand, hand, image[:, left : left + 60])
        markers = {
            m.color: m for m in step.step(studio.of(studio.bgr(image, 4.0, seq), seq)).markers
        }
        marker, (x, y) = markers.get("green"), truth["green"]
        found.append(marker is not None and np.hypot(marker.x_px - x - left, marker.y_px - y) < 4.0)
    assert np.mean(found[6:]) > 0.9
