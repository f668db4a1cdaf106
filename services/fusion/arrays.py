"""Array types of fusion beside rhot.geometry.transforms.Array, which is of floats."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
