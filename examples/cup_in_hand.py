"""Where an object is in the hand: its place in the wrist's own frame, at the pose's instant."""

import sys

import numpy as np

import rhot
from rhot.geometry.transforms import rotation_from_quaternion

OBJECT = sys.argv[2] if len(sys.argv) > 2 else "cup"


def main() -> None:
    with rhot.open(*sys.argv[1:2]) as rig:
        for pose in rig.hand_poses("right"):
            cup = rig.object_at(OBJECT, pose.stamp_ns)
            if cup is None or cup.tracking != "ok":
                print(f"the {OBJECT} is not tracked", flush=True)
                continue
            R_rig_from_wrist = rotation_from_quaternion(pose.wrist.orientation_wxyz)
            apart_m = np.subtract(cup.position_m, pose.wrist.position_m)
            right_mm, up_mm, back_mm = 1000 * R_rig_from_wrist.T @ apart_m
            print(f"right {right_mm:.0f}, up {up_mm:.0f}, back {back_mm:.0f} mm", flush=True)


main()
