"""The parts of fusion and of the tracker that ablate.py takes out, one at a time, and how.

A part is taken out from here, by replacing it for the run: the product has no switches for it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion import step as fusion_step
from services.fusion.alignment.level_views import LevelViews
from services.fusion.intake.observations import View
from services.fusion.kalman import hand_filter
from services.fusion.kalman.motion.motion_models import MotionModels
from services.fusion.output.systematic_error import SystematicError
from services.fusion.paint.hidden_paint import HiddenPaint
from services.fusion.paint.paint_to_bone import PaintToBone
from services.pi_tracker.identify import group_consistency
from services.pi_tracker.identify.background import BackgroundModel
from services.pi_tracker.identify.marker_identity import MarkerIdentity
from testing.families.pictures import Without

OF_PAINT = (  # points have none of these
    "finger direction",
    "paint to bone",
    "hidden paint",
    "shape of paint",
    "surer directions",
    "systematic error",
)
_MODELS = hand_filter.MODELS


def _only(*rows: int) -> MotionModels:
    """Fusion's ladder of these rows."""
    return MotionModels(*(column[list(rows)] for column in _MODELS))


class _PaintAsItIs(PaintToBone):
    """Paint of no extent, of which nothing is known."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        # In place: kernels know where these are.
        for known in (self.known.radii_m, self.known.sags_m, self.known.areas_m2):
            known[:] = 0.0


class _AllShows(HiddenPaint):
    """Paint that nothing hides."""

    def observe(self, view: View, time_s: float) -> Array:  # noqa: ARG002 - as HiddenPaint's
        return np.zeros(len(view.landmarks))


def _told(name: str, value: float) -> type[HiddenPaint]:
    """Paint of which areas tell nothing: a column of KnownPaint stays at a value."""

    class Told(HiddenPaint):
        def observe(self, view: View, time_s: float) -> Array:
            found = super().observe(view, time_s)
            getattr(self.paint, name)[:] = value
            return found

    return Told


# Landmarks that have nothing in common but how lively they are.
_EACH_BY_ITSELF = _MODELS._replace(
    shift=np.zeros_like(_MODELS.shift),
    turn=np.zeros_like(_MODELS.turn),
    along=np.zeros_like(_MODELS.along),
    own=_MODELS.shift + _MODELS.own,
)


class Part(NamedTuple):
    """A part that can be off.

    without makes the context of a run; settings are of [fusion]; tracker: the markers are those of
    a tracker without it.
    """

    about: str
    without: Without = contextlib.nullcontext
    settings: dict[str, Any] = {}  # noqa: RUF012 - never written
    feedback: bool = True
    tracker: bool = False


def _replaced(*places: tuple[object, str, object]) -> Without:
    """Names of modules or classes (place, name, stand-in) replaced while the context lasts."""

    @contextlib.contextmanager
    def context() -> Iterator[None]:
        with contextlib.ExitStack() as stack:
            for place, name, stand_in in places:
                stack.enter_context(patch.object(place, name, stand_in))
            yield

    return context


PARTS: dict[str, Part] = {
    "rest": Part(
        "no model of a hand at rest",
        _replaced((hand_filter, "MODELS", _only(*range(1, len(_MODELS.own))))),
    ),
    "mixture of models": Part(
        "one model of motion instead of several, neither calm nor lively",
        _replaced((hand_filter, "MODELS", _only(3))),
    ),
    "liveliest model": Part(
        "the ladder ends before the model of sharp turns",
        _replaced((hand_filter, "MODELS", _only(*range(len(_MODELS.own) - 1)))),
    ),
    "way": Part(
        "no model knows which way the hand came",
        _replaced((hand_filter, "MODELS", _MODELS._replace(along=np.zeros_like(_MODELS.along)))),
    ),
    "shared motion": Part(
        "landmarks of a hand do not move together",
        _replaced((hand_filter, "MODELS", _EACH_BY_ITSELF)),
    ),
    "gate": Part("innovations are never refused", _replaced((hand_filter, "GATE", np.inf))),
    "clock tuning": Part("offsets stay as announced", settings={"tune_clocks": False}),
    "level views": Part(
        "views are as they were calibrated, tilted cameras or not",
        _replaced((LevelViews, "take", lambda _self, _heights: None)),
    ),
    "finger direction": Part("no poses come back from the solver", feedback=False),
    "paint to bone": Part(
        "the visible middle of paint is told as it is, its covariance too",
        _replaced((fusion_step, "PaintToBone", _PaintAsItIs)),
    ),
    "hidden paint": Part(
        "areas tell nothing of what hides a marker, nor of its shape",
        _replaced((fusion_step, "HiddenPaint", _AllShows)),
    ),
    "shape of paint": Part(
        "paint is as its model has it, sigma says",
        _replaced((fusion_step, "HiddenPaint", _told("shape_sds", 0.0))),
    ),
    "surer directions": Part(
        "directions are as unsure as poses tell, whatever areas say",
        _replaced((fusion_step, "HiddenPaint", _told("direction_shares", 1.0))),
    ),
    "systematic error": Part(
        "all of a marker's sigma is white noise",
        # Of points without extent nothing is systematic.
        _replaced(
            (fusion_step, "SystematicError", lambda e, c: SystematicError(np.zeros_like(e), c))
        ),
    ),
    "plausibility": Part(
        "points need not belong together",
        _replaced((fusion_step, "hand_reach_m", lambda _model: np.inf)),
    ),
    "background": Part(
        "tracker: static colours are not learned",
        _replaced((BackgroundModel, "foreground", lambda _self, _image, blobs, _noise: blobs)),
        tracker=True,
    ),
    "group": Part(
        "tracker: markers need not be near each other and alike in size",
        _replaced((group_consistency, "_pair_consistency", lambda _a, _b: 1.0)),
        tracker=True,
    ),
    "tracks and rims": Part(
        "tracker: any blob is as likely as another",
        _replaced((MarkerIdentity, "_prior", lambda *_: 1.0)),
        tracker=True,
    ),
}
TRACKERS = {name: part.without for name, part in PARTS.items() if part.tracker}
