"""After warming up, a live rig compiles nothing more: fusion and solver, each told of the other.

A kernel that is compiled at the first pose stands still for seconds. In a process of its own, as
other tests compile kernels too.
"""

from __future__ import annotations

import subprocess
import sys

RUN = """
import sys
from numba.core.dispatcher import Dispatcher
from rhot.hand import default_hand
from services.fusion.step import FusionStep
from services.fusion.warm import warm_up as warm_fusion
from services.solver.step import SolverStep
from services.solver.warm import warm_up as warm_solver
from testing.synthetic_points import MovingHand, SyntheticRig, frames

def compiled():
    return {
        f"{name}.{key}": len(value.signatures)
        for name, module in list(sys.modules.items()) if name.startswith(("services.", "rhot."))
        for key, value in vars(module).items() if isinstance(value, Dispatcher)
    }

setup, hands = SyntheticRig(), {"right": default_hand("right")}
config = setup.config()
warm_fusion(config, setup.rig(), hands)
warm_solver(config, hands)
before = compiled()
fusion, solver, poses = FusionStep(config, setup.rig(), hands), SolverStep(config, hands), 0
for frame in frames(setup, MovingHand(), 2.0):
    # One camera is gone for a while.
    if frame.camera == "left" and 30 <= frame.seq < 36:
        continue
    for points in fusion.step(frame):
        pose = solver.step(points)
        if pose is not None:
            poses += 1
            fusion.note_pose(pose)
after = compiled()
print(poses, *sorted(name for name in after if after[name] != before.get(name)))
"""


def test_a_live_rig_compiles_nothing_after_warming_up():
    done = subprocess.run(
        [sys.executable, "-c", RUN], capture_output=True, text=True, check=True, timeout=280
    )
    poses, *new = done.stdout.split()
    assert int(poses) > 30
    assert new == []
