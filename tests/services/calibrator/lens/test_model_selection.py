"""The choice of a lens model: nested models, and the simplest good one."""

from __future__ import annotations

import itertools

import numpy as np

from services.calibrator.lens.model_selection import LENS_MODELS, choose_model


def test_models_are_nested_and_the_simplest_good_one_wins():
    for simple, complex_ in itertools.pairwise(LENS_MODELS):
        assert np.all(complex_.free[simple.free])
    names = [model.name for model in LENS_MODELS]
    errors = dict(zip(names, [2.0, 1.005, 1.0, 1.2, 1.3], strict=True))
    assert choose_model(lambda model: errors[model.name]).name == "k1"
