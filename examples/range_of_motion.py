"""The range that each joint has used, in degrees: bend and stretch, then press Ctrl-C."""

import sys

import numpy as np

import rhot
from rhot.hand import DIGIT_ANGLES, DIGITS


def main() -> None:
    low, high = np.full((5, 4), np.inf), np.full((5, 4), -np.inf)
    with rhot.open(*sys.argv[1:2]) as rig:
        print("bend and stretch your fingers; Ctrl-C prints the table", flush=True)
        for pose in rig.hand_poses("right"):
            for row, finger in enumerate(pose.fingers):
                # What was predicted nobody has done.
                if finger.status == "solved":
                    angles = np.degrees(finger.model_angles_rad)
                    low[row], high[row] = (
                        np.minimum(low[row], angles),
                        np.maximum(high[row], angles),
                    )
    for row, digit in enumerate(DIGITS):
        for joint, name in enumerate(DIGIT_ANGLES[row]):
            if np.isfinite(low[row, joint]):
                print(f"{digit:7}{name:10}{low[row, joint]:6.0f} to{high[row, joint]:5.0f} deg")


main()
