"""Rooms that nobody arranged: a hand before things in its paints' colours, by number. Pure data.

What a camera at somebody's desk may see: any lamp that is not coloured, any skin, noise from that
of a bright room to that of a dim one, pictures as cameras process them, motions that rest and
motions that do not. A number says everything; each is another person, too.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from services.simulator.scene.catalog import Light, Vec3
from services.simulator.scene.paints import Rgb
from testing.families.case import Half
from testing.families.people import PaintJob, Person
from testing.families.picture_motions import Moves
from testing.families.pictures import Recipe

# The first number of each half. (Those from 1000 on were looked at twice while the layout of a hand
# was made to count.)
FIRST: dict[Half, int] = {"tuning": 0, "held_out": 2000}
_GESTURES = ("random", "grab", "fist", "piano", "pinch", "still")
_PATHS = ("", "", "roll", "flap", "stop_and_go")
_DARK, _PALE = np.array([0.17, 0.085, 0.055]), np.array([0.74, 0.50, 0.41])


def room(number: int) -> Recipe:
    """A room by its number."""
    rng = np.random.default_rng([number, 77])
    gesture, path = str(rng.choice(_GESTURES)), str(rng.choice(_PATHS))
    # Nobody could tell a hand that never moves from a thing.
    path = path or ("roll" if gesture == "still" else "")
    strength = rng.uniform(3.0, 10.0) if path == "stop_and_go" else rng.uniform(15.0, 40.0)
    shade = rng.uniform()
    skin = _PALE * shade + _DARK * (1.0 - shade)
    return Recipe(
        moves=Moves(gesture, path, float(strength), hz=float(rng.uniform(0.4, 1.0)), seed=number),
        person=Person(float(rng.uniform(0.8, 1.15)), seed=number),
        paint=PaintJob(
            (float(rng.uniform(8.0, 14.0)), float(rng.uniform(14.0, 18.0))),
            dab_off_mm=3.0,
            uneven=float(rng.uniform(0.0, 0.4)),
            seed=number,
        ),
        light=_lamps(rng),
        skin=cast("Rgb", tuple(skin.tolist())),
        distance_m=float(rng.uniform(0.35, 0.75)),
        tilt_deg=float(rng.uniform(5.0, 55.0)),
        exposure_s=float(rng.choice([0.004, 0.008, 0.012, 0.016])),
        noise=float(rng.choice([3.0, 5.0, 7.0, 10.0])),
        jpeg=int(rng.choice([0, 0, 60, 85])),
        sharpen=float(rng.choice([0.0, 0.0, 0.5])),
        denoise=float(rng.choice([0.0, 0.0, 0.5])),
        clutter=True,
        seconds=3.0,
        seed=number,
    )


def _lamps(rng: np.random.Generator) -> Light:
    """Two lamps of one colour, warm to cool, from the cameras' side; bright to half as bright."""
    warm, bright = rng.uniform(-0.2, 0.35), rng.uniform(0.5, 1.0)
    tint = np.array([1.0 + warm, 1.0, 1.0 - warm])

    def glow(share: float) -> Rgb:
        return cast("Rgb", tuple((share * tint).tolist()))

    def side() -> Vec3:
        way = rng.normal(size=3)
        way *= np.array([1.0, 0.6, 0.5]) / np.linalg.norm(way)
        return cast("Vec3", tuple((way + np.array([0.0, -0.3, -0.6])).tolist()))

    return Light(
        key_from=side(),
        key=glow(0.85 * bright),
        fill_from=side(),
        fill=glow(0.17 * rng.uniform(0.0, 1.5)),
        ambient=glow(0.3 * rng.uniform(0.3, 1.1)),
        flicker=float(rng.choice([0.0, 0.1, 0.3])),
        flicker_hz=float(rng.choice([100.0, 120.0])),
    )
