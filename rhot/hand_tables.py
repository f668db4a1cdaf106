"""Measures of an average adult's right hand, for a hand that was never measured.

Numbers only, in mm and degrees; rhot.hand.default_hand makes a hand model of them. Where each comes
from stands beside it.
"""

from __future__ import annotations

# Bone lengths, Buryanov & Kotiuk, "Proportions of Hand Segments", Int. J. Morphol. 28(3), 2010, n =
# 66: metacarpal, proximal, middle, distal + pulp. Not the thumb's: with that metacarpal (46.2) and
# its distal bone (21.7 + 5.7) it reaches 9 and 14 mm farther than the thumbs of two trackers of
# hands whose fingers are as long as these (the recorded poses of iwer, 32.5, 33.8, 24.6; the Leap
# recordings, 40.0, 31.6, 20.0 + pulp); a thumb that is too long bends, and rolls the whole hand.
# Bones and base are about their mean. benchmarks/unmeasured_posture.py, of the Leap and of the
# poses: the thumb's last bone off by 35 and 26 -> 23 and 11 deg RMS, orientation by 16.6 and 7.0 ->
# 14.7 and 6.4, fingers by 23 and 16 -> 23 and 18.
BONES_MM = {
    "thumb": (36.0, 32.5, 0.0, 24.8),
    "index": (68.1, 39.8, 22.4, 15.8 + 3.8),
    "middle": (64.6, 44.6, 26.3, 17.4 + 4.0),
    "ring": (58.0, 41.4, 25.7, 17.3 + 4.0),
    "little": (53.7, 32.7, 18.1, 16.0 + 3.7),
}
# Start of the metacarpals in the wrist frame, and their directions (towards the thumb), fitted by
# eye to the three recorded OpenXR poses of the npm package iwer 2.5.0 (relaxed, point, pinch),
# mirrored; the thumb's between theirs (-20, -25, -38) and the Leap recordings' (-25, -8, -24).
CARPUS_MM = {
    "thumb": (-23.0, -16.0, -31.0),
    "index": (-17.0, -6.0, -30.0),
    "middle": (-3.0, -4.0, -31.0),
    "ring": (10.0, -5.0, -30.0),
    "little": (20.0, -8.0, -28.0),
}
METACARPAL_DEG = {"index": 5.0, "middle": 1.0, "ring": -5.0, "little": -13.0}
# Direction of the straight fingers, from the same recordings: towards the thumb, about the bone.
SPLAY_DEG = {
    "index": (6.0, 3.0),
    "middle": (0.0, 0.0),
    "ring": (-6.0, -7.0),
    "little": (-13.0, -16.0),
}
# -z and x of the thumb's metacarpal frame at rest, from the same recordings, not yet orthonormal.
THUMB_FORWARD = (-0.675, -0.250, -0.690)
THUMB_RIGHT = (0.115, 0.887, -0.442)
# Skin radii at the four chain joints, rounded from the same recordings.
RADII_MM = {
    "thumb": (17.0, 12.0, 9.8, 8.8),
    "index": (10.5, 8.8, 7.8, 6.8),
    "middle": (11.0, 8.8, 7.8, 6.8),
    "ring": (10.2, 8.2, 7.4, 6.4),
    "little": (9.0, 7.2, 6.6, 5.6),
}
# Joint limits (low, high) of abduction and the three flexions. Type I, RHOT eq. (1) and (2); the
# thumb's from the ranges of motion of the AAOS handbook (CMC 53 deg of flexion-extension and 42 deg
# of palmar abduction about the resting pose, MCP 0..55, IP 0..80).
FINGER_LIMITS_DEG = ((-15.0, 15.0), (0.0, 90.0), (0.0, 110.0), (0.0, 90.0))
MIDDLE_LIMITS_DEG = ((0.0, 0.0), (0.0, 90.0), (0.0, 110.0), (0.0, 90.0))
THUMB_LIMITS_DEG = ((-17.0, 25.0), (-23.0, 30.0), (0.0, 55.0), (0.0, 80.0))
