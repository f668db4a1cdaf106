"""The families of pictures, a tuning and a held-out half each. Pure data.

The halves differ in kind where they can: ranges do not overlap, other lamps, other processing.
Constants may be chosen on the tuning half only.
"""

from __future__ import annotations

from functools import partial

from services.simulator.scene.catalog import Light
from testing.families.case import CaseSpec, Half
from testing.families.people import PaintJob, Person
from testing.families.picture_motions import Moves
from testing.families.pictures import Recipe, picture_case

_Recipes = dict[str, Recipe]
_PIANO = Moves("piano")
_PEOPLE: dict[Half, _Recipes] = {
    "tuning": {
        "average adult": Recipe(person=Person(0.97, seed=1), seed=21),
        "small adult, playing": Recipe(
            moves=_PIANO, person=Person(0.88, seed=2), given_scale=0.9, seed=22
        ),
    },
    "held_out": {
        "child": Recipe(person=Person(0.68, seed=11), given_scale=0.75, distance_m=0.42, seed=31),
        "large adult, a fist": Recipe(
            moves=Moves("fist"), person=Person(1.18, seed=12), given_scale=1.1, seed=32
        ),
        "adult as if average": Recipe(
            moves=Moves("pinch"), person=Person(1.05, seed=13), given_scale=1.0, seed=33
        ),
    },
}
_PAINT: dict[Half, _Recipes] = {
    "tuning": {
        "11 to 16 mm, dab 2 mm off": Recipe(
            paint=PaintJob((11.0, 16.0), dab_off_mm=2.0, uneven=0.15, seed=1), seed=23
        ),
        "12 mm, playing": Recipe(moves=_PIANO, paint=PaintJob((12.0, 12.0), seed=2), seed=24),
    },
    "held_out": {
        "8 to 10 mm, dab 5 mm off": Recipe(
            paint=PaintJob((8.0, 10.0), dab_off_mm=5.0, uneven=0.2, seed=11), seed=34
        ),
        "17 to 20 mm, ragged": Recipe(
            moves=Moves("fist"),
            paint=PaintJob((17.0, 20.0), dab_off_mm=4.0, uneven=0.4, seed=12),
            seed=35,
        ),
    },
}
# Albedos of the skin: within the range of measured skins, which is from a tenth to four tenths in
# green.
_SKIN: dict[Half, _Recipes] = {
    "tuning": {"tanned": Recipe(skin=(0.42, 0.22, 0.14), seed=25)},
    "held_out": {
        "dark": Recipe(skin=(0.17, 0.085, 0.055), seed=36),
        "pale": Recipe(moves=_PIANO, skin=(0.74, 0.50, 0.41), seed=37),
    },
}
_LIGHT: dict[Half, _Recipes] = {
    "tuning": {
        "from the left, 10 % flicker": Recipe(
            light=Light(key_from=(-0.9, -0.4, -0.4), flicker=0.1, flicker_hz=100.0), seed=26
        ),
        "dim": Recipe(
            light=Light(key=(0.6, 0.58, 0.55), ambient=(0.2, 0.2, 0.2)), noise=7.0, seed=27
        ),
    },
    "held_out": {
        "warm, from below right, 35 % flicker": Recipe(
            light=Light(
                key_from=(0.7, 0.6, -0.5),
                key=(0.95, 0.74, 0.48),
                fill=(0.18, 0.15, 0.11),
                ambient=(0.30, 0.25, 0.18),
                flicker=0.35,
                flicker_hz=120.0,
            ),
            exposure_s=0.0045,
            seed=38,
        ),
        "cold window behind, coloured rim": Recipe(
            moves=_PIANO,
            light=Light(
                key_from=(0.5, -0.8, 0.15),
                key=(0.62, 0.74, 0.92),
                ambient=(0.26, 0.29, 0.34),
                rim_from=(-0.8, -0.2, 0.3),
                rim=(0.1, 0.35, 0.3),
            ),
            seed=39,
        ),
    },
}
_PICTURES: dict[Half, _Recipes] = {
    "tuning": {
        "sharpened": Recipe(sharpen=1.0, seed=28),
        "JPEG 90": Recipe(moves=_PIANO, jpeg=90, seed=29),
    },
    "held_out": {
        "denoised and sharpened": Recipe(denoise=0.75, sharpen=1.5, seed=40),
        "JPEG 70": Recipe(moves=_PIANO, jpeg=70, seed=41),
        "limited range taken for full": Recipe(moves=Moves("fist"), wrong_range=True, seed=42),
    },
}
_ROOM: dict[Half, _Recipes] = {
    "tuning": {"coloured things behind": Recipe(moves=_PIANO, clutter=True, seed=51)},
    "held_out": {
        "coloured things, a child waves": Recipe(
            moves=Moves("wave", "roll", 15.0, hz=0.7, seed=13),
            person=Person(0.8, seed=14),
            given_scale=0.85,
            clutter=True,
            seed=52,
        ),
    },
}
_MOTION: dict[Half, _Recipes] = {
    "tuning": {
        "stop and go 10 m/s2": Recipe(
            moves=Moves("still", "stop_and_go", 10.0, seed=1), distance_m=0.6, seed=30
        ),
        "slow roll": Recipe(moves=Moves("piano", "roll", 25.0, hz=0.4), seed=43),
        "leap grab": Recipe(recording="grab", tilt_deg=30.0, seed=47),
        "leap wave": Recipe(recording="wave", tilt_deg=20.0, seed=48),
    },
    "held_out": {
        "stop and go 16 m/s2, fingers wander": Recipe(
            moves=Moves("piano", "stop_and_go", 16.0, seed=11), distance_m=0.6, seed=44
        ),
        "flapping .75 m/s": Recipe(moves=Moves("still", "flap", 50.0, hz=1.5, seed=11), seed=45),
        "roll and wait": Recipe(moves=Moves("wave", "roll", 40.0, hz=0.5, seed=12), seed=46),
        "leap splay": Recipe(recording="HandSplay-110fps", tilt_deg=20.0, seed=49),
        "leap pinch": Recipe(recording="pinch", tilt_deg=30.0, seed=50),
    },
}
_FAMILIES: dict[str, dict[Half, _Recipes]] = {
    "people": _PEOPLE,
    "paint": _PAINT,
    "skin": _SKIN,
    "light": _LIGHT,
    "processing": _PICTURES,
    "room": _ROOM,
    "motion": _MOTION,
}


def picture_cases() -> list[CaseSpec]:
    """All cases of pictures."""
    return [
        CaseSpec(family, name, half, "pictures", partial(picture_case, name, recipe))
        for family, halves in _FAMILIES.items()
        for half, recipes in halves.items()
        for name, recipe in recipes.items()
    ]


def recipes(half: Half) -> dict[str, Recipe]:
    """The recipes of a half by their names."""
    return {
        f"{family}: {name}": recipe
        for family, halves in _FAMILIES.items()
        for name, recipe in halves[half].items()
    }
