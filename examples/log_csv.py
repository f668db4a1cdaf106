"""Every pose of the right hand as a row of hand.csv: seconds, tips in mm, angles in degrees."""

import csv
import sys

import numpy as np

import rhot
from rhot.hand import DIGIT_ANGLES, DIGITS


def main() -> None:
    with open("hand.csv", "w", newline="") as file, rhot.open(*sys.argv[1:2]) as rig:
        rows = csv.writer(file)
        tips = [f"{digit}_tip_{axis}_mm" for digit in DIGITS for axis in "xyz"]
        heads = zip(DIGITS, DIGIT_ANGLES, strict=True)
        angles = [f"{d}_{name}_deg" for d, names in heads for name in names]
        rows.writerow(["seconds", *tips, *angles])
        start_ns = 0
        for pose in rig.hand_poses("right", queue=256):
            start_ns = start_ns or pose.stamp_ns
            tips_mm = [1000 * x for d in DIGITS for x in pose.joint(f"{d}_tip").position_m]
            angles_deg = np.degrees(pose.angles_rad).ravel()
            seconds = (pose.stamp_ns - start_ns) * 1e-9
            rows.writerow([f"{value:.3f}" for value in [seconds, *tips_mm, *angles_deg]])
            print(f"\r{seconds:.1f} s", end="", flush=True)


main()
