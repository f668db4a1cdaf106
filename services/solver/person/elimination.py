"""Solves the equations of a calibration: frames are independent given their take's offsets, takes given the person.

So frames are eliminated one by one, then takes (Schur complements), and what is left is small. Matrices that are not definite
raise numpy.linalg.LinAlgError.
"""

from __future__ import annotations

import numpy as np

from rhot.transforms import Array
from services.solver.person.problem import Equations, Problem


class Eliminated:
    """Frames and takes of `found` factored; damping is Levenberg and Marquardt's, per take (t,); bent adds Newton's terms."""

    def __init__(self, problem: Problem, found: Equations, *, damping: Array | None = None, bent: bool = False) -> None:
        self.problem, self.found = problem, found
        H = found.H + found.bent if bent else found.H.copy()
        offsets_H = found.offsets_H
        if damping is not None:
            diagonal = np.arange(H.shape[1])
            H[:, diagonal, diagonal] += damping[problem.take_of, None] * found.H[:, diagonal, diagonal]
            offsets_H = offsets_H * (1.0 + damping[:, None])
        self.L = np.linalg.cholesky(H)
        self._X = found.X + found.bent_X if bent else found.X
        self.inverse = np.linalg.inv(H)
        self._HB = self.inverse @ found.B
        S = offsets_H[:, :, None] * np.eye(offsets_H.shape[1]) - problem.by_take(np.swapaxes(found.B, 1, 2) @ self._HB)
        self.S_L = np.linalg.cholesky(S)
        self.S_inverse = np.linalg.inv(S)

    def log_det(self) -> float:
        """Of all frames' and offsets' information."""
        return sum(2.0 * float(np.log(np.diagonal(L, axis1=1, axis2=2)).sum()) for L in (self.L, self.S_L))

    def solve(self, g: Array, offsets_g: Array) -> tuple[Array, Array]:
        """Inverse times a vector of the frames (n, 26) and offsets (t, 25)."""
        Hg = np.einsum("nab,nb->na", self.inverse, g)
        left = offsets_g - self.problem.by_take(np.einsum("nab,na->nb", self.found.B, Hg))
        offsets = np.einsum("tab,tb->ta", self.S_inverse, left)
        return Hg - np.einsum("nab,nb->na", self._HB, offsets[self.problem.take_of]), offsets

    def by_person(self) -> tuple[Array, Array]:
        """How frames (n, 26, p) and offsets (t, 25, p) follow the person: minus inverse times their common equations."""
        HX = self.inverse @ self._X
        left = self.found.offsets_X - self.problem.by_take(np.swapaxes(self.found.B, 1, 2) @ HX)
        offsets = self.S_inverse @ left
        return self._HB @ offsets[self.problem.take_of] - HX, -offsets

    def covariances(self) -> tuple[Array, Array, Array]:
        """Blocks of the inverse: frames (n, 26, 26), frames with their offsets (n, 26, 25), offsets (t, 25, 25)."""
        S_inverse = self.S_inverse[self.problem.take_of]
        mixed = -self._HB @ S_inverse
        return self.inverse - mixed @ np.swapaxes(self._HB, 1, 2), mixed, self.S_inverse
