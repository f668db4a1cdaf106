"""How many lens parameters the data supports: five nested models, chosen by cross-validation. Pure.

More free parameters always lower the error on the pictures they were fitted to; on held-out
pictures they may raise it. The simplest model that comes within a hundredth of the best held-out
error wins. Each of the five is one of Brown-Conrady's, and of a fisheye lens its counterpart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.bundle.lens_model import (
    CX,
    CY,
    FX,
    FY,
    K1,
    K2,
    K3,
    LENS_SIZE,
    P1,
    P2,
    is_fisheye,
)

# A simpler model may be this much worse: differences below are chance with 6..20 pictures.
_SLACK = 1.01


@dataclass(frozen=True, eq=False)
class LensModel:
    """A name, and which of the nine numbers of a lens are free; the same of a fisheye lens."""

    name: str
    free: np.ndarray  # (9,) bool
    fisheye_name: str
    fisheye_free: np.ndarray  # (9,) bool

    def free_of(self, lenses: Array) -> np.ndarray:
        """Which numbers of these lenses (..., 9) are free; (..., 9) bool."""
        return np.where(is_fisheye(lenses)[..., None], self.fisheye_free, self.free)

    def reduced(self, lenses: Array) -> Array:
        """The lenses (..., 9) with zero for what the model lacks; a fisheye stays one."""
        kept = self.free_of(lenses)
        kept[..., K3] |= is_fisheye(lenses)
        return np.where(kept, lenses, 0.0)

    def name_of(self, lenses: Array) -> str:
        """What to call the model of these lenses (c, 9)."""
        names = [self.fisheye_name if wide else self.name for wide in is_fisheye(lenses)]
        return " / ".join(dict.fromkeys(names))


def only_free(*numbers: int) -> np.ndarray:
    """A mask (9,) bool of these numbers of a lens."""
    free = np.zeros(LENS_SIZE, dtype=bool)
    free[list(numbers)] = True
    return free


def _model(name: str, *distortion: int, fisheye: int) -> LensModel:
    numbers = (K1, K2, P1, P2)[:fisheye]
    fisheye_name = " ".join(["fisheye", *(f"k{k + 1}" for k in range(fisheye))])
    pinhole = (FX, FY, CX, CY)
    return LensModel(
        name, only_free(*pinhole, *distortion), fisheye_name, only_free(*pinhole, *numbers)
    )


LENS_MODELS = (
    _model("no distortion", fisheye=0),
    _model("k1", K1, fisheye=1),
    _model("k1 k2", K1, K2, fisheye=2),
    _model("k1 k2 p1 p2", K1, K2, P1, P2, fisheye=3),
    _model("k1 k2 p1 p2 k3", K1, K2, P1, P2, K3, fisheye=4),
)
# The model to begin with, before any choice, and to screen pictures with: the richest there is, as
# a poorer one takes good pictures at the edge of the image for bad ones. Of 50 synthetic pictures
# of each of two lenses with k3, k1 k2 p1 p2 left out 2 to 11, this one none (of five lenses).
USUAL_MODEL = LENS_MODELS[4]


def choose_model(held_out_error: Callable[[LensModel], float]) -> LensModel:
    """The simplest model whose held-out error is within a hundredth of the best."""
    errors = [held_out_error(model) for model in LENS_MODELS]
    limit = _SLACK * min(errors)
    good = (model for model, error in zip(LENS_MODELS, errors, strict=True) if error <= limit)
    return next(good, USUAL_MODEL)
