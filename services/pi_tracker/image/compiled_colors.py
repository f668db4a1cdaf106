"""The layers of a ColorTable for compiled code, by the range of a picture's levels; pure."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.planes import LIMITED_CHROMA, LIMITED_LUMA, Planes

Layers = npt.NDArray[np.uint32]  # (layers, 65536) as ColorTable has them


class InC(ctypes.Structure):
    """colors of compiled/classes.h."""

    _fields_ = (("layers", ctypes.c_void_p), ("count", ctypes.c_int32))


class CompiledColors:
    """The colours of one table; they must outlive what is given their addresses."""

    def __init__(self, layers: Sequence[npt.NDArray[np.uint32]]) -> None:
        # By whether levels are of full range. The structures have the layers' addresses.
        self._layers: dict[bool, Layers] = {False: np.ascontiguousarray(layers, np.uint32)}
        self._in_c: dict[bool, InC] = {}

    def of(self, planes: Planes) -> InC:
        """For levels as planes have them; made when the first such picture comes."""
        return self._in_c.get(planes.full_range) or self._made(planes.full_range)

    def _made(self, full_range: bool) -> InC:
        if full_range not in self._layers:
            self._layers[full_range] = full_range_layers(self._layers[False])
        layers = self._layers[full_range]
        self._in_c[full_range] = InC(layers.ctypes.data, len(layers))
        return self._in_c[full_range]


def full_range_layers(layers: Layers) -> Layers:
    """Layers for levels of full range, by what LIMITED_LUMA and LIMITED_CHROMA make of these."""
    of = layers.view(np.uint8).reshape(-1, 256, 256, 4)[:, LIMITED_CHROMA][:, :, LIMITED_CHROMA]
    # Both grow with their levels: those between the first and the last that is within.
    low = np.searchsorted(LIMITED_LUMA, of[..., 1], "left")
    high = np.searchsorted(LIMITED_LUMA, of[..., 2], "right") - 1
    none = low > high
    of[..., 1], of[..., 2] = np.where(none, 255, low), np.where(none, 0, high)
    return of.view(np.uint32).reshape(-1, 65536)
