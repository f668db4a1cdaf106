"""How DIP follows PIP: a line or a parabola through measured angles, and which is better supported.

Residuals within a closing are alike from frame to frame, so that AIC, BIC and the F test, which
take each frame for a witness of its own, find a parabola nearly always. What decides is
cross-validation: each closing is predicted by the law fitted to the others. Pure.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from rhot.geometry.transforms import Array

# Frames that tell both angles, for a fit.
_MIN_FRAMES = 6
# rad; PIP must move that far, or a law is a guess.
_MIN_RANGE_RAD = np.deg2rad(15.0)
# A parabola must predict closings that it has not seen better by this share; 5 % of 3 deg is far
# below what a joint can be measured to.
_WORTHWHILE = 0.05


class Law(NamedTuple):
    """DIP = a + b PIP + c PIP^2, rad; valid between the PIP angles it was fitted to."""

    coefficients: tuple[float, float, float]
    pip_range: tuple[float, float]

    def dip(self, pip: Array) -> Array:
        """DIP (n,) at PIP (n,); beyond the fitted range the law goes on along its tangent.

        A parabola would turn round there.
        """
        a, b, c = self.coefficients
        inside = np.clip(pip, *self.pip_range)
        return a + b * inside + c * inside**2 + (b + 2.0 * c * inside) * (pip - inside)


class LawFit(msgspec.Struct, frozen=True):
    """One fitted law and how well it fits, in deg."""

    coefficients: tuple[float, float, float]  # rad
    rms_deg: float
    unseen_rms_deg: float | None  # of closings left out; None with fewer than three
    aicc: float
    bic: float


class LawSupport(msgspec.Struct, frozen=True):
    """Line against parabola for one person."""

    frames: int
    closings: int
    line: LawFit
    parabola: LawFit
    two_thirds_rms_deg: float
    two_thirds_max_deg: float
    f_test_p: float  # that the parabola's third coefficient is chance, frames taken as independent
    better: str  # "line" or "parabola"
    why: str


def fit_law(pip: Array, dip: Array, degree: int) -> Law | None:
    """Least squares over frames that have both angles; None where they tell too little."""
    known = np.isfinite(pip) & np.isfinite(dip)
    if known.sum() < _MIN_FRAMES or np.ptp(pip[known]) < _MIN_RANGE_RAD:
        return None
    fitted = np.polynomial.polynomial.polyfit(pip[known], dip[known], degree)
    a, b, c = np.append(fitted, np.zeros(2 - degree)).tolist()
    return Law((a, b, c), (float(pip[known].min()), float(pip[known].max())))


def joined(closings: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """PIP (n,) and DIP (n,) of all closings, one after the other."""
    return np.concatenate([one[0] for one in closings]), np.concatenate([o[1] for o in closings])


def law_support(closings: Sequence[tuple[Array, Array]]) -> LawSupport | None:
    """Both laws of one person's closings (PIP, DIP); None where the angles tell too little."""
    pip, dip = joined(closings)
    line, parabola = (_fitted(closings, degree) for degree in (1, 2))
    if line is None or parabola is None:
        return None
    known = np.isfinite(pip) & np.isfinite(dip)
    off = np.rad2deg(dip[known] - 2.0 / 3.0 * pip[known])
    better, why = _decided(line, parabola)
    return LawSupport(
        frames=int(known.sum()),
        closings=len(closings),
        line=line,
        parabola=parabola,
        two_thirds_rms_deg=float(np.sqrt(np.mean(off**2))),
        two_thirds_max_deg=float(np.abs(off).max()),
        f_test_p=_f_test(line.rms_deg, parabola.rms_deg, int(known.sum())),
        better=better,
        why=why,
    )


def _fitted(closings: Sequence[tuple[Array, Array]], degree: int) -> LawFit | None:
    pip, dip = joined(closings)
    law = fit_law(pip, dip, degree)
    if law is None:
        return None
    known = np.isfinite(pip) & np.isfinite(dip)
    off = (dip - law.dip(pip))[known]
    n, k = len(off), degree + 2  # with the variance
    # 1e-12: a perfect fit has no logarithm.
    log_variance = n * np.log(np.mean(off**2) + 1e-12)
    return LawFit(
        coefficients=law.coefficients,
        rms_deg=float(np.rad2deg(np.sqrt(np.mean(off**2)))),
        unseen_rms_deg=_unseen_rms_deg(closings, degree),
        aicc=float(log_variance + 2 * k + 2 * k * (k + 1) / max(n - k - 1, 1)),
        bic=float(log_variance + k * np.log(n)),
    )


def _unseen_rms_deg(closings: Sequence[tuple[Array, Array]], degree: int) -> float | None:
    """RMS of each closing predicted by the law of the others."""
    if len(closings) < 3:
        return None
    squares: list[Array] = []
    for left_out, (pip, dip) in enumerate(closings):
        others = [one for k, one in enumerate(closings) if k != left_out]
        law = fit_law(*joined(others), degree)
        if law is None:
            return None
        off = dip - law.dip(pip)
        squares.append(off[np.isfinite(off)] ** 2)
    return float(np.rad2deg(np.sqrt(np.mean(np.concatenate(squares)))))


def _f_test(line_rms: float, parabola_rms: float, n: int) -> float:
    """Probability of so much less residual by chance, one more coefficient and n frames."""
    from scipy.special import betainc

    freedom = n - 3
    if freedom < 1 or line_rms <= parabola_rms:
        return 1.0
    ratio = (line_rms**2 / max(parabola_rms**2, 1e-12) - 1.0) * freedom
    return float(betainc(0.5 * freedom, 0.5, freedom / (freedom + ratio)))


def _decided(line: LawFit, parabola: LawFit) -> tuple[str, str]:
    """The better supported law, and by what."""
    if line.unseen_rms_deg is None or parabola.unseen_rms_deg is None:
        better = "parabola" if parabola.bic < line.bic - 10.0 else "line"
        return better, "BIC alone: fewer than three closings, so that none could be left out"
    gain = 1.0 - parabola.unseen_rms_deg / max(line.unseen_rms_deg, 1e-9)
    if gain > _WORTHWHILE and parabola.bic < line.bic:
        return "parabola", (
            f"it predicts closings left out with {parabola.unseen_rms_deg:.2f} deg RMS, the line"
            f" with {line.unseen_rms_deg:.2f}; BIC agrees"
        )
    return "line", (
        f"the parabola predicts closings left out with {parabola.unseen_rms_deg:.2f} deg RMS, the"
        f" line with {line.unseen_rms_deg:.2f}: not {100 * _WORTHWHILE:.0f} % better"
    )
