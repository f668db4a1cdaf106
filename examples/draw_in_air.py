"""Draw with the index finger while the thumb touches it; Ctrl-C writes drawing.svg."""

import sys
from pathlib import Path

import numpy as np

import rhot


def main() -> None:
    strokes: list[list[str]] = [[]]
    with rhot.open(*sys.argv[1:2]) as rig:
        for pose in rig.hand_poses("right", queue=64):
            x, y, z = pose.joint("index_tip").position_m
            gap_m = np.linalg.norm(np.subtract(pose.joint("thumb_tip").position_m, (x, y, z)))
            if gap_m < 0.03:
                strokes[-1].append(f"{1000 * x:.1f},{1000 * y:.1f}")
            elif strokes[-1]:
                print(f"stroke {len(strokes)}: {len(strokes[-1])} points", flush=True)
                strokes.append([])
    lines = "\n".join(f'<polyline points="{" ".join(stroke)}"/>' for stroke in strokes)
    style = 'viewBox="-200 -200 400 400" fill="none" stroke="black" stroke-width="2"'
    Path("drawing.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {style}>{lines}</svg>')
    print(f"drawing.svg: {len(strokes) - 1} strokes")


main()
