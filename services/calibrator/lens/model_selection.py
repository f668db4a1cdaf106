"""How many lens numbers the data supports: five nested models, chosen by the error on held-out
pictures. Pure.

More numbers always lower the error on the pictures they were fitted to; on pictures left out they
may raise it. The simplest model that comes within a hundredth of the best held-out error wins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from services.calibrator.bundle.lens_model import CX, CY, FX, FY, K1, K2, K3, P1, P2

# A simpler model may be this much worse: differences below are chance with 6..20 pictures.
_SLACK = 1.01
# Parts into which pictures are divided to choose a model: with ten, nine tenths of the pictures
# calibrate.
_FOLDS = 10


@dataclass(frozen=True, eq=False)
class LensModel:
    """A name and which of the nine lens numbers are free."""

    name: str
    free: np.ndarray


def _model(name: str, *numbers: int) -> LensModel:
    free = np.zeros(9, dtype=bool)
    free[[FX, FY, CX, CY, *numbers]] = True
    return LensModel(name, free)


MODELS = (
    _model("no distortion"),
    _model("k1", K1),
    _model("k1 k2", K1, K2),
    _model("k1 k2 p1 p2", K1, K2, P1, P2),
    _model("k1 k2 p1 p2 k3", K1, K2, P1, P2, K3),
)
# The model to begin with, before any choice: fits every lens that is not a fisheye.
USUAL = MODELS[3]


def folds(count: int, parts: int = _FOLDS) -> list[np.ndarray]:
    """Numbers 0..count-1 dealt into parts, neighbours into different ones.

    One each if there are fewer than parts.
    """
    return [
        part
        for k in range(min(count, parts))
        if len(part := np.arange(k, count, min(count, parts)))
    ]


def choose(held_out: Callable[[LensModel], float]) -> tuple[LensModel, dict[str, float]]:
    """The simplest model whose held-out error is within a hundredth of the best, and every model's
    error.
    """
    errors = {model.name: held_out(model) for model in MODELS}
    best = min(errors.values())
    chosen = next((model for model in MODELS if errors[model.name] <= _SLACK * best), USUAL)
    return chosen, errors
