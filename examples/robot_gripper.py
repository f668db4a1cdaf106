"""A gripper that opens as far as thumb and index finger do: a command 20 times a second.

Where no pose is new the command is `hold`: a robot must know when nobody is watching.
"""

import sys
import time

import numpy as np

import rhot

CLOSED_M, OPEN_M = 0.015, 0.090


def main() -> None:
    with rhot.open(*sys.argv[1:2]) as rig:
        while True:
            pose = rig.latest_pose("right", max_age_s=0.1)
            if pose is None or pose.finger("index").status == "predicted":
                print("hold", flush=True)
            else:
                thumb, index = pose.joint("thumb_tip"), pose.joint("index_tip")
                gap_m = np.linalg.norm(np.subtract(thumb.position_m, index.position_m))
                opening = np.clip((gap_m - CLOSED_M) / (OPEN_M - CLOSED_M), 0.0, 1.0)
                print(f"open {opening:.2f}", flush=True)
            time.sleep(0.05)


main()
