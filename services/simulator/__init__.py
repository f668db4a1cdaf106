"""Simulator: a rig of virtual cameras, with ground truth."""

from pathlib import Path

from rhot.kernels.numba_cache import use_cache

# Before any module of this package imports numba.
use_cache(Path(__file__).parents[1])
