"""The families of points, a tuning and a held-out half each. Pure data.

The halves differ in kind where they can: other recordings, other shapes of motion, ranges that do
not overlap. Constants may be chosen on the tuning half only.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from testing.families.case import Case, CaseSpec, Half
from testing.families.motions import clapping, flapping, rolling, stop_and_go, tapping
from testing.families.points import Gaps, Wander, lazily
from testing.families.recordings import glove_motion, leap_motion
from testing.synthetic_points import MovingHand, RestingHand, SyntheticRig

_Makers = dict[str, Callable[[str], Case]]
_THREE_TIPS = (2, 3, 4)
_ALL = (0, 1, 2, 3, 4, 5)

# Real recordings, and shapes of motion that real hands have and sinusoids do not. Held out: other
# recordings, other accelerations, claps for taps, rolls that wait for rolls that do not.
_MOTION: dict[Half, _Makers] = {
    "tuning": {
        "leap grab": lazily(partial(leap_motion, "grab")),
        "leap wave": lazily(partial(leap_motion, "wave")),
        "glove, first 20 s": lazily(partial(glove_motion, 0, 2000)),
        "sinusoids .5 m/s": lazily(partial(MovingHand, seed=1)),
        "stop and go 10 m/s2": lazily(partial(stop_and_go, 10.0, 1)),
        "stop and go 14 m/s2": lazily(partial(stop_and_go, 14.0, 2)),
        "flapping slowly": lazily(partial(flapping, 1.3, 40.0, 1)),
        "taps": lazily(partial(tapping, 4.0, 0.025, 1)),
        "roll": lazily(partial(rolling, 0.4, 30.0, 1)),
        "at rest": lazily(partial(RestingHand, distance_m=0.7, seed=1)),
    },
    "held_out": {
        "leap splay": lazily(partial(leap_motion, "HandSplay-110fps")),
        "leap pinch": lazily(partial(leap_motion, "pinch")),
        "glove, last 30 s": lazily(partial(glove_motion, 3000, 6000)),
        "sinusoids .8 m/s": lazily(partial(MovingHand, speed_m_s=0.8, distance_m=0.9, seed=21)),
        "stop and go 8 m/s2": lazily(partial(stop_and_go, 8.0, 11)),
        "stop and go 20 m/s2": lazily(partial(stop_and_go, 20.0, 12)),
        "flapping .75 m/s": lazily(partial(flapping, 1.5, 55.0, 7)),
        "claps": lazily(partial(clapping, 1.2, 0.14, 11)),
        "roll, splay, wait": lazily(partial(rolling, 0.65, 45.0, 11)),
        "at rest, one finger plays": lazily(partial(RestingHand, distance_m=0.9, plays=3, seed=11)),
    },
}
# Noise: white, or as learned detectors and light have it, the same for some frames.
_NOISE: dict[Half, _Makers] = {
    "tuning": {
        "white .2 px": lazily(partial(MovingHand, seed=2), rig=SyntheticRig(sigma_px=0.2)),
        "white .03 px": lazily(
            partial(stop_and_go, 12.0, 3), rig=SyntheticRig(sigma_px=0.03, loss=0.0)
        ),
    },
    "held_out": {
        "white .12 px, 6 % of frames lost": lazily(
            partial(leap_motion, "HandSplay-110fps", 0.6),
            rig=SyntheticRig(sigma_px=0.12, loss=0.06, seed=12),
        ),
        "correlated .7, .1 px": lazily(
            partial(glove_motion, 3000, 4500),
            rig=SyntheticRig(sigma_px=0.04, seed=13),
            wander=Wander(0.1, 0.7, seed=13),
        ),
    },
}
# Other rigs: wider, turned in, faster, slower, three cameras, or exposing soon one after the other.
_RIG: dict[Half, _Makers] = {
    "tuning": {
        "60 fps": lazily(partial(stop_and_go, 12.0, 4), rig=SyntheticRig(fps=60.0, phase_s=0.008)),
        "three cameras": lazily(
            partial(MovingHand, seed=3), rig=SyntheticRig(cameras=3, phase_s=0.011)
        ),
        "2 ms apart": lazily(partial(stop_and_go, 12.0, 8), rig=SyntheticRig(phase_s=0.002)),
    },
    "held_out": {
        "25 fps, 120 mm apart, turned in": lazily(
            partial(glove_motion, 4000, 5500, 0.6),
            rig=SyntheticRig(fps=25.0, phase_s=0.013, baseline_m=0.12, toe_in_rad=0.1, seed=14),
        ),
        "90 fps, triggered together": lazily(
            partial(stop_and_go, 18.0, 15), rig=SyntheticRig(fps=90.0, phase_s=0.0, seed=15)
        ),
        "5 ms apart": lazily(
            partial(leap_motion, "pinch"), rig=SyntheticRig(phase_s=0.005, seed=18)
        ),
    },
}
# Markers that are missing: everywhere, from one camera for half a second, one camera for .3 s.
_GAPS: dict[Half, _Makers] = {
    "tuning": {
        "20 % missing": lazily(partial(MovingHand, seed=4), gaps=Gaps(share=0.2)),
        "three tips, one camera": lazily(
            partial(MovingHand, seed=5),
            gaps=Gaps(blind=((1, _THREE_TIPS, 1.5, 0.5),)),
        ),
    },
    "held_out": {
        "12 % missing": lazily(
            partial(leap_motion, "HandSplay-110fps"), gaps=Gaps(share=0.12, seed=11)
        ),
        "thumb and little finger, in turns": lazily(
            partial(glove_motion, 3000, 4500),
            gaps=Gaps(blind=((0, (1,), 1.2, 0.4), (1, (5,), 2.0, 0.6))),
        ),
        "one camera for .3 s": lazily(
            partial(stop_and_go, 8.0, 16), gaps=Gaps(blind=((0, _ALL, 1.6, 0.3),), every_s=2.5)
        ),
    },
}
# Cameras that were calibrated before they tilted; deg.
_TILT: dict[Half, _Makers] = {
    "tuning": {
        ".1 deg down": lazily(
            partial(MovingHand, seed=9), rig=SyntheticRig(tilt_rad=np.deg2rad(-0.1))
        ),
    },
    "held_out": {
        ".2 deg up": lazily(
            partial(leap_motion, "HandSplay-110fps"),
            rig=SyntheticRig(tilt_rad=np.deg2rad(0.2), seed=19),
        ),
    },
}
# Offsets of clocks that were announced wrongly.
_CLOCKS: dict[Half, _Makers] = {
    "tuning": {
        "5 ms, 10 announced": lazily(
            partial(MovingHand, seed=6),
            rig=SyntheticRig(clock_error_s=0.005, clock_sigma_s=0.01),
        ),
        "0, .2 announced": lazily(
            partial(stop_and_go, 14.0, 7),
            rig=SyntheticRig(clock_error_s=0.0, clock_sigma_s=0.0002),
        ),
    },
    "held_out": {
        "-3 ms, 5 announced": lazily(
            partial(leap_motion, "HandSplay-110fps"),
            rig=SyntheticRig(clock_error_s=-0.003, clock_sigma_s=0.005, seed=17),
        ),
        "1 ms, 1 announced": lazily(
            partial(stop_and_go, 16.0, 18),
            rig=SyntheticRig(clock_error_s=0.001, clock_sigma_s=0.001, seed=18),
        ),
    },
}
_FAMILIES: dict[str, dict[Half, _Makers]] = {
    "motion": _MOTION,
    "noise": _NOISE,
    "rig": _RIG,
    "gaps": _GAPS,
    "tilt": _TILT,
    "clocks": _CLOCKS,
}


def point_cases() -> list[CaseSpec]:
    """All cases of points."""
    return [
        CaseSpec(family, name, half, "points", partial(maker, name))
        for family, halves in _FAMILIES.items()
        for half, makers in halves.items()
        for name, maker in makers.items()
    ]
