"""Clips as cases that held_out_score.py judges: the markers found in them, and the truth.

Fusion and solver are given the tables' hand at a guessed size. What takes long comes from disk
where it was made before.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from rhot.hand import default_hand
from rhot.messages import MarkerFrame
from testing.families.case import Case
from testing.families.marker_cache import digest_of, kept
from testing.second_renderer.clip import Clip
from testing.second_renderer.filming import detected, film
from testing.second_renderer.motion import Array
from testing.second_renderer.paint import LANDMARKS, landmarks_at


def clip_case(name: str, clip: Clip) -> Case:
    """A clip as a case."""
    frames, shares = kept("clip", (_code(), clip), lambda: _filmed(clip), tracker=True)
    _, paint = clip.hand()

    @cache
    def at(time_s: float) -> Array:
        bones = clip.play.bones(np.array([time_s]))
        return landmarks_at(paint, bones.wrist[0], bones.axes[0], bones.joints[0])

    def truth(times_s: Array) -> Array:
        flat = np.asarray(times_s, dtype=np.float64).ravel().tolist()
        return np.array([at(time_s) for time_s in flat]).reshape(-1, len(LANDMARKS), 3)

    return Case(
        name=name,
        config=clip.config(),
        cameras=clip.rig.cameras(),
        hands={"right": default_hand("right", clip.given_scale)},
        frames=frames,
        visible=np.array([shares[frame.camera][frame.seq] for frame in frames]),
        landmarks=LANDMARKS,
        truth=truth,
        seconds=clip.seconds,
        clock_errors_s={"left": 0.0, "right": -clip.rig.clock_error_s},
    )


def _filmed(clip: Clip) -> tuple[list[MarkerFrame], dict[str, Array]]:
    shots = film(clip)
    return detected(clip, shots), shots.shares


@cache
def _code() -> str:
    """A digest of what makes the pictures, and of what fits colours to clicks on them.

    Not of catalog/: a clip says all of itself.
    """
    return digest_of(*Path(__file__).parent.glob("*.py"), tracker=True)
