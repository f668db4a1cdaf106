"""Clips by number: everything is drawn, so none was arranged, and none is looked at for long.

Hands of all sizes that a table has, each recording carried about in each way, whatever light, skin,
paint, sensor and rig the clips that were made by hand have something like. Drawn anew where a hand
leaves a view or moves faster than any is asked for.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from itertools import islice
from typing import Literal, cast

import numpy as np

from testing.families.case import Half
from testing.second_renderer.catalog.lights import COLD, DARK, PALE, WARM, WINDOW
from testing.second_renderer.clip import SIZE_PX, Clip, Rig
from testing.second_renderer.motion import Carried, Play
from testing.second_renderer.paint import Job
from testing.second_renderer.pictures import Shutter
from testing.second_renderer.room import Light
from testing.second_renderer.sensor import Sensor
from testing.second_renderer.skin import Build

# The first number of each half.
FIRST: dict[Half, int] = {"tuning": 0, "held_out": 1000}
_RECORDINGS = ("HandSplay-110fps", "grab", "pinch", "wave")
# By kind: degrees to either side (drift: mm), and times a second.
_CARRIED = {
    "": ((0.0, 0.0), (0.5, 0.5)),
    "roll": ((10.0, 35.0), (0.3, 0.6)),
    "wait": ((20.0, 40.0), (0.3, 0.5)),
    "flap": ((15.0, 40.0), (0.5, 1.1)),
    "drift": ((30.0, 90.0), (0.3, 0.6)),
}
# Ends of fingers are this far within both pictures, px, in all of so many instants a second, and
# move at most so fast, m/s.
_WITHIN_PX, _PER_S, _FASTEST_M_S = 25.0, 60.0, 1.7


def drawn(half: Half, count: int) -> dict[str, Clip]:
    """The first clips of a half by their numbers."""
    first = FIRST[half]
    return {f"no. {number}": drawn_clip(number) for number in range(first, first + count)}


def drawn_clip(number: int) -> Clip:
    """A clip by its number."""
    return next(islice(filter(_is_asked_for, _clips(number)), 1))


def _clips(number: int) -> Iterator[Clip]:
    rng = np.random.default_rng([number, 91])
    while True:
        scale = float(rng.uniform(0.8, 1.1))
        yield Clip(
            _play(rng, scale),
            build=Build(float(rng.uniform(0.93, 1.08)), float(rng.uniform(0.95, 1.05))),
            job=_job(rng, number),
            light=_light(rng),
            shutter=Shutter(float(rng.uniform(0.004, 0.012)), float(rng.uniform(20e-6, 35e-6))),
            sensor=_sensor(rng),
            rig=_rig(rng),
            given_scale=round(scale * float(rng.uniform(0.95, 1.05)), 3),
            seed=number,
        )


def _play(rng: np.random.Generator, scale: float) -> Play:
    kind = str(rng.choice(list(_CARRIED)))
    size, hz = _CARRIED[kind]
    way = cast("Literal['', 'roll', 'wait', 'flap', 'drift']", kind)
    return Play(
        str(rng.choice(_RECORDINGS)),
        Carried(way, float(rng.uniform(*size)), float(rng.uniform(*hz))),
        speed=float(rng.uniform(0.4, 1.3)),
        begin=float(rng.uniform(0.0, 0.3)),
        end=float(rng.uniform(0.5, 1.0)),
        scale=scale,
        distance_m=float(rng.uniform(0.38, 0.65)),
        tilt_deg=float(rng.uniform(-15.0, 25.0)),
        yaw_deg=float(rng.uniform(-15.0, 15.0)),
        roll_deg=float(rng.uniform(-30.0, 30.0)),
        at=(float(rng.uniform(-0.1, 0.1)), float(rng.uniform(-0.07, 0.07))),
    )


def _job(rng: np.random.Generator, seed: int) -> Job:
    shortest = float(rng.uniform(9.0, 14.0))
    shade = rng.uniform()
    skin = (1.0 - shade) * np.array(DARK) + shade * np.array(PALE)
    return Job(
        (shortest, shortest + float(rng.uniform(2.0, 5.0))),
        ragged_mm=float(rng.uniform(0.5, 1.3)),
        dab_off_mm=float(rng.uniform(0.0, 5.0)),
        patchy=float(rng.uniform(0.05, 0.3)),
        skin=cast("tuple[float, float, float]", tuple(skin.tolist())),
        seed=seed,
    )


def _light(rng: np.random.Generator) -> Light:
    """One of the lamps that other clips have, brighter or dimmer."""
    of = [Light(), WARM, COLD, WINDOW][int(rng.integers(4))]
    strength = rng.uniform(0.75, 1.2)
    lamps = tuple(
        dataclasses.replace(
            lamp, color=cast("tuple[float, float, float]", tuple(strength * np.array(lamp.color)))
        )
        for lamp in of.lamps
    )
    return dataclasses.replace(of, lamps=lamps)


def _sensor(rng: np.random.Generator) -> Sensor:
    return Sensor(
        gain=float(rng.uniform(0.9, 1.1)),
        white=(float(rng.uniform(0.95, 1.06)), float(rng.uniform(0.95, 1.08))),
        blur_px=float(rng.uniform(0.5, 0.85)),
        electrons=float(rng.uniform(1200.0, 2600.0)),
        sharpen=float(rng.choice([0.0, 0.0, 0.4, 0.8])),
        jpeg=int(rng.choice([0, 0, 77, 90])),
    )


def _rig(rng: np.random.Generator) -> Rig:
    return Rig(
        baseline_m=float(rng.uniform(0.07, 0.11)),
        toe_in_deg=float(rng.uniform(0.0, 5.0)),
        fov_deg=float(rng.uniform(58.0, 66.0)),
        phase_s=float(rng.uniform(0.0, 1.0 / 30.0)),
        skew_s=float(rng.uniform(-0.02, 0.02)),
        clock_error_s=float(rng.uniform(-5e-4, 5e-4)),
    )


def _is_asked_for(clip: Clip) -> bool:
    """Whether both cameras have all tips of a hand that is no faster than any must be."""
    bones = clip.play.bones(np.arange(0.0, clip.seconds, 1.0 / _PER_S))
    paths_m = np.concatenate([bones.wrist[:, None], bones.joints[:, :, -1]], axis=1)
    if np.linalg.norm(np.diff(paths_m, axis=0), axis=2).max() * _PER_S > _FASTEST_M_S:
        return False
    high = np.array(SIZE_PX) - _WITHIN_PX
    for camera in clip.rig.cameras().values():
        at_px = camera.project(paths_m.reshape(-1, 3))
        if not (np.all(at_px > _WITHIN_PX) and np.all(at_px < high)):
            return False
    return True
