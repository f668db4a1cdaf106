"""A lens fitted again with another model, and its error on pictures held out of the fit. Pure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.bundle.adjust import Adjustment, FreeUnknowns, adjust
from services.calibrator.bundle.cross_validation import adjust_without, folds
from services.calibrator.bundle.residuals import View, rms
from services.calibrator.bundle.views import single_view
from services.calibrator.lens.fit import fit_poses
from services.calibrator.lens.model_selection import LensModel, only_free
from services.calibrator.lens.result import LensFit


def refit(fit: LensFit, model: LensModel) -> Adjustment:
    """The fit with another model, from the lens there is; what the model lacks is zero."""
    state = fit.found.state
    start = replace(state, lenses=model.reduced(state.lenses))
    return adjust(fit.views, start, free_unknowns(fit, model))


def free_unknowns(fit: LensFit, model: LensModel) -> FreeUnknowns:
    """The numbers of the fit's lens that the model has, and the poses of the boards."""
    return FreeUnknowns.one_lens(model.free_of(fit.found.state.lenses[0]))


def held_out_px(fit: LensFit, model: LensModel) -> float:
    """RMS px over all pictures, each with the lens from the folds it is not in."""
    start = refit(fit, model).state
    free = free_unknowns(fit, model)
    squares = []
    for held_out in folds(len(fit.views)):
        lens = adjust_without(fit.views, start, held_out, free).lenses[0]
        squares += [rms(best_pose(lens, fit.views[k]).residuals[0]) ** 2 for k in held_out]
    return float(np.sqrt(np.mean(squares)))


def best_pose(lens: Array, view: View) -> Adjustment:
    """The pose of one view's board that suits it best with this lens."""
    return fit_poses(lens, [single_view(view)], only_free())
