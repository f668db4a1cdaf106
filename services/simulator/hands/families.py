"""Hands that differ as people's do, for what must hold for more than one hand. Pure."""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.hand import HandModel, HandName, default_hand

# HandModel.origin of these hands.
VARIED = "simulated"
# Size against the average adult's, and each bone's share of that.
_SCALE, _BONE = (0.8, 1.15), (0.9, 1.1)


def varied_hand(hand: HandName, seed: int) -> HandModel:
    """A hand of that seed: another size, and each bone by up to 10 % another length."""
    rng = np.random.default_rng([seed, 53])
    model = default_hand(hand, float(rng.uniform(*_SCALE)))
    share = rng.uniform(*_BONE, (5, 3))
    digits = [
        msgspec.structs.replace(
            digit,
            lengths_m=tuple((np.array(digit.lengths_m) * row).tolist()),
        )
        for digit, row in zip(model.digits, share, strict=True)
    ]
    return msgspec.structs.replace(model, digits=tuple(digits), origin=VARIED)
