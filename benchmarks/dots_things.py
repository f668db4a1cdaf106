"""Dots of one colour on things that are no hand: which dot is which, through the real finder.

    python benchmarks/dots_things.py [--pictures 120] [--speeds 1 2]

Drawn pictures, 640x480, 30 a second, blurred by motion, noise, JPEG: a grid, a plate with dots
anywhere, a chain of beads, a ring, a leg that walks; eight dots each. Clicks of the first picture
are 2 px off. Shares in percent of all dots that are told within 10 px, not told, and told
elsewhere: plain assignment to the nearest patches, and rhot live.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import cv2
import numpy as np
from dots import Told, moved_to_nearest

from rhot.files.rig_tables import Tracker
from rhot.geometry.transforms import Array
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.dots.finder import DotFinder
from services.pi_tracker.image.frame import Frame
from testing.dot_pictures import COLORS, NAMES

SIZE, RATE, NEAR_PX, CLICK_PX = (640, 480), 30.0, 10.0, 2.0
SEED = 5


def things() -> dict[str, Array]:
    """Places of eight dots about the middle of each, px."""
    along, around = np.arange(8.0), np.arange(8.0) * np.pi / 4.0
    grid = np.array([[54.0 * x, 54.0 * y] for y in (0, 1) for x in range(4)])
    heights = (-150.0, -100.0, -50.0, -10.0, 40.0, 90.0, 130.0, 145.0)
    return {
        "grid": grid - grid.mean(axis=0),
        "plate": np.random.default_rng(SEED).uniform(-110.0, 110.0, (8, 2)),
        "beads": np.stack([40.0 * along - 140.0, np.zeros(8)], axis=1),
        "ring": 90.0 * np.stack([np.cos(around), np.sin(around)], axis=1),
        "leg": np.array([(0, 5, 10, 12, 8, 4, 0, 35), heights]).T,
    }


def turned(places: Array, angle: float) -> Array:
    """Places (n, 2) turned about the origin."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(places @ np.array([[cosine, sine], [-sine, cosine]]))


def places_at(name: str, thing: Array, time_s: float, speed: float) -> Array:
    """Where the dots are (8, 2), px."""
    own, phase = thing.copy(), 2.0 * np.pi * time_s
    if name == "beads":
        own[:, 1] += 30.0 * np.sin(0.7 * np.arange(8) + 0.6 * phase)
    if name == "leg":
        for joint, swing, late in ((3, 0.5, 0.3), (5, 0.6, 1.4)):
            angle = swing * np.sin(0.9 * phase + late)
            own[joint + 1 :] = own[joint] + turned(own[joint + 1 :] - own[joint], angle)
    shift = 80.0 * speed * np.array([np.sin(0.4 * phase + 1.0), 0.7 * np.sin(0.55 * phase + 2.0)])
    return np.array([320.0, 240.0]) + shift + turned(own, 0.3 * speed * np.sin(0.5 * phase))


def picture(number: int, exposed: Sequence[Array]) -> Frame:
    """A picture of dots that move through these places while it is exposed."""
    light = np.zeros((2 * SIZE[1], 2 * SIZE[0], 3), np.float32)
    for places in exposed:
        one = np.full(light.shape, (90, 110, 100), np.uint8)
        for x, y in places:
            cv2.circle(one, (round(32 * x), round(32 * y)), 16 * 14, (35, 25, 190), -1, shift=4)
        light += one
    blurred = cv2.GaussianBlur((light / len(exposed)).astype(np.uint8), (0, 0), 1.5)
    image = cv2.resize(blurred, SIZE, interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(number).normal(0.0, 4.0, image.shape)
    noisy = np.clip(image + noise, 0, 255).astype(np.uint8)
    packed = cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, 60])[1]
    bgr = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR))
    return Frame("side", number, round(number * 1e9 / RATE), 0.0, SIZE, bgr, "bgr")


def followed(name: str, thing: Array, pictures: int, speed: float) -> dict[str, Array]:
    """Counts of dots that are right, not told, and elsewhere, by method."""
    table, random = compile_colors(COLORS, ["red", "blue"]), np.random.default_rng(SEED)
    truth = [places_at(name, thing, number / RATE, speed) for number in range(pictures)]
    clicks = truth[0] + random.normal(0.0, CLICK_PX, (8, 2))
    seeds = {n: (float(x), float(y)) for n, (x, y) in zip(NAMES, clicks, strict=True)}
    finder = DotFinder(table, "red", Tracker(), NAMES, SIZE, seeds, remembers=True)
    live: list[Told] = []
    for number in range(pictures):
        times = [(number + share) / RATE for share in (-0.2, 0.0, 0.2)]
        exposed = [places_at(name, thing, time_s, speed) for time_s in times]
        dots = finder.find(picture(number, exposed))
        live.append({n: (d.x_px, d.y_px) for n, d in dots.items() if d.state != "carried"})
    plain: list[Told] = []
    for seen in finder.seen:
        own = moved_to_nearest(clicks, seen.patches, optimal=True)
        plain.append({n: tuple(clicks[k]) for k, n in enumerate(NAMES) if own[k] >= 0})
    return {"plain": counted(truth, plain), "rhot": counted(truth, live)}


def counted(truth: Sequence[Array], told: Sequence[Told]) -> Array:
    """How many dots are right, not told, elsewhere (3,)."""
    counts = np.zeros(3)
    for places, dots in zip(truth, told, strict=True):
        for name, place in zip(NAMES, places, strict=True):
            if name not in dots:
                counts[1] += 1
            else:
                counts[0 if np.hypot(*(np.array(dots[name]) - place)) < NEAR_PX else 2] += 1
    return counts


def main() -> None:
    """Measure all things and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", type=int, default=120)
    parser.add_argument("--speeds", type=float, nargs="+", default=[1.0, 2.0])
    options = parser.parse_args()
    print(f"{'speed':>5}  {'thing':8}{'method':8}{'right %':>9}{'lost %':>9}{'wrong %':>9}")
    for speed in options.speeds:
        for name, thing in things().items():
            for method, counts in followed(name, thing, options.pictures, speed).items():
                shares = "".join(f"{share:9.2f}" for share in 100.0 * counts / counts.sum())
                print(f"{speed:5.1f}  {name:8}{method:8}{shares}", flush=True)


if __name__ == "__main__":
    main()
