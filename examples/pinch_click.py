"""Thumb and index finger as a mouse button: prints `down` and `up`."""

import sys

import numpy as np

import rhot

DOWN_M, UP_M = 0.020, 0.035  # between the tips' middles; two limits, so that it does not flutter


def main() -> None:
    pressed = False
    with rhot.open(*sys.argv[1:2]) as rig:
        for pose in rig.hand_poses("right"):
            thumb, index = pose.joint("thumb_tip"), pose.joint("index_tip")
            gap_m = np.linalg.norm(np.subtract(thumb.position_m, index.position_m))
            if gap_m < DOWN_M and not pressed:
                pressed = True
                print("down at", index.position_m, flush=True)
            elif gap_m > UP_M and pressed:
                pressed = False
                print("up", flush=True)


main()
