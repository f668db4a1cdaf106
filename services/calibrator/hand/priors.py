"""How much hands differ: standard deviations of the hand parameters before any measurement. Pure
data.
"""

from __future__ import annotations

import numpy as np

# Spread (standard deviation over mean) of the bones of one size of hand, by digit: Buryanov &
# Kotiuk 2010 (n = 66) give these over all sizes, 0.07 to 0.15; hand length over both sexes spreads
# by 0.065, which is SIZE_SD's part. At least 0.06, for X-rays measure well.
BONE_SD = (
    (0.06, 0.073, 0.06),
    (0.104, 0.091, 0.131),
    (0.06, 0.093, 0.088),
    (0.068, 0.110, 0.109),
    (0.06, 0.122, 0.142),
)
METACARPAL_SD = (0.06, 0.067, 0.06, 0.06, 0.06)
# About the size that the open hand showed, which itself is good to a few percent.
SIZE_SD = 0.10
# Where the first joint of a chain sits beside its metacarpal's direction; the thumb's saddle joint
# in all directions. People differ by more, but how the wrist's frame lies in the hand is a
# convention: free by 1.5 and 3 mm (and 2 mm of the wrist's paint) it tilts, and the orientation
# error of the solver was 1.3 instead of 1.2 times that with true bones.
ACROSS_SD_M, THUMB_BASE_SD_M = 0.0007, 0.002
# How a chain's straight posture may be rotated about its axis of abduction and about its bone, rad.
# Tight: wrist and tips hardly show it, and a finger whose roll is wrong by 6 deg doubles the
# solver's error, so that guessing is worse than the table.
ROTATION_SD, THUMB_ROTATION_SD = np.deg2rad([1.5, 1.0]), np.deg2rad([3.0, 3.0])
# Where a dab of paint is put; the wrist's is part of the convention above. A dipped tip is painted
# all round: its middle is on the bone's axis (first two coordinates) but for cameras' views, 0.3
# radii in the worst case.
WRIST_PAINT_SD_M = (0.001, 0.001, 0.001)
PAINT_SD_M = (0.002, 0.002, 0.002)
TIP_PAINT_SD_M = (0.0005, 0.0005, 0.002)
# DIP/PIP of real hands: .68-.74 in strong flexion, less when relaxed (finger study, Fig. 7).
COUPLING_SD = 0.05
