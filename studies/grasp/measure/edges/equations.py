"""Normal equations of pictures that form a chain and of a shape that they share. Pure.

The poses' part is banded, as each picture is tied to the one before it; the shape is a border of it
and is solved after it (Schur complement).
"""

from __future__ import annotations

import numpy as np

from studies.grasp.measure.edges.segments import Array
from studies.grasp.measure.edges.silhouette import POSE


class System:
    """Of f pictures and a shape of so many terms. Rows by shape may be shorter: the rest is 0."""

    def __init__(self, pictures: int, terms: int) -> None:
        self.band = np.zeros((2 * POSE, POSE * pictures))
        self.band[0] = 1e-6
        self.border = np.zeros((POSE * pictures, terms))
        self.right = np.zeros(POSE * pictures)
        self.shape = np.zeros((terms, terms))
        self.shape_right = np.zeros(terms)

    def add(
        self, picture: int, by_pose: Array, by_shape: Array, weights: Array, pull: Array
    ) -> None:
        """Residuals of one picture: rows (n, 6), (n, terms), weights (n,), weight * miss (n,)."""
        own = slice(POSE * picture, POSE * (picture + 1))
        block = by_pose.T @ (weights[:, None] * by_pose)
        for below in range(POSE):
            self.band[below, own.start : own.stop - below] += np.diagonal(block, -below)
        weighted = weights[:, None] * by_shape
        terms = by_shape.shape[1]
        self.border[own, :terms] += by_pose.T @ weighted
        self.shape[:terms, :terms] += by_shape.T @ weighted
        self.right[own] += by_pose.T @ pull
        self.shape_right[:terms] += by_shape.T @ pull

    def link(self, picture: int, miss: Array, information: Array) -> None:
        """The move (6,) from the picture before: what it lacks, and its information (6,)."""
        at = POSE * picture
        self.band[0, at : at + POSE] += information
        self.band[0, at - POSE : at] += information
        self.band[POSE, at - POSE : at] -= information
        self.right[at : at + POSE] += information * miss
        self.right[at - POSE : at] -= information * miss

    def know(self, row: Array, miss: float, sigma: float) -> None:
        """Something about the shape alone."""
        self.shape += np.outer(row, row) / sigma**2
        self.shape_right += row * (miss / sigma**2)

    def solved(self) -> tuple[Array, Array, Array, Array]:
        """Steps of poses (f, 6) and shape, the shape's covariance, poses by shape (6 f, terms)."""
        # Not above: scipy takes longer to import than most commands take to run.
        from scipy.linalg import solveh_banded

        solved = solveh_banded(self.band, np.c_[self.border, self.right], lower=True)
        by_shape, alone = solved[:, :-1], solved[:, -1]
        covariance = np.linalg.inv(self.shape - self.border.T @ by_shape)
        step = covariance @ (self.shape_right - self.border.T @ alone)
        return (alone - by_shape @ step).reshape(-1, POSE), step, covariance, by_shape
