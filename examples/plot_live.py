"""PIP angles of the last ten seconds as a live plot; needs `pip install 'rhot[study]'`."""

import sys
from collections import deque

import matplotlib.pyplot as plt
import numpy as np

import rhot

FINGERS = ("index", "middle", "ring", "little")


def main() -> None:
    rows: deque = deque(maxlen=300)
    axes = plt.figure("rhot").gca()
    with rhot.open(*sys.argv[1:2]) as rig:
        for pose in rig.hand_poses("right", queue=30):
            angles = [pose.finger(name).angles_rad.pip for name in FINGERS]
            rows.append([pose.stamp_ns * 1e-9, *np.degrees(angles)])
            if len(rows) % 6 == 0:
                axes.clear()
                axes.plot(np.array(rows)[:, 0], np.array(rows)[:, 1:], label=FINGERS)
                axes.set(xlabel="time, s", ylabel="PIP flexion, deg")
                axes.legend()
                plt.pause(0.001)
                print(f"\r{len(rows)} poses", end="", flush=True)


main()
