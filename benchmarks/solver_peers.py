"""Inverse kinematics of other people's packages on the index finger, for benchmarks/solver.py.

What is absent is skipped and says why. Every peer gets the same chain (as URDF, or the functions of
kinematics.py), the same goals (tip pose) and the same end: position within 1e-6 mm and orientation
within 1e-8 rad, or 100 iterations. It starts each frame from its own last solution.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array, vector_from_rotation
from services.solver.maths.chains import Chain, max_reach, norm
from services.solver.maths.kinematics import tip_jacobian, tip_position, tip_rotation
from services.solver.maths.rotation_vectors import rotation_vector

NEAR_M, NEAR_RAD, MOST = 1e-9, 1e-8, 100
# One frame: tip position (3,), axes of the last bone (3, 3) -> angles (4,).
Solve = Callable[[Array, Array], Array]
_AXES = ("0 1 0", "-1 0 0", "-1 0 0", "-1 0 0")


def peers(chain: Chain) -> tuple[dict[str, Solve], dict[str, str]]:
    """The solvers of all peers that are installed, by name, and why the others are missing."""
    installed, skipped = {}, {}
    for name, make in PEERS.items():
        try:
            installed[name] = make(chain)
        except ImportError as error:
            skipped[name] = f"{error}; pip install {PACKAGES.get(name, name)}"
    return installed, skipped


def urdf(chain: Chain) -> Path:
    """The chain as a URDF file: four revolute joints with limits, a link `tip`."""
    offsets = ("0 0 0", "0 0 0", f"0 0 {-chain.lengths[0]}", f"0 0 {-chain.lengths[1]}")
    inertial = (
        '<inertial><mass value="0.01"/>'
        '<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    text = '<robot name="finger"><link name="base"/>'
    for j, (axis, offset) in enumerate(zip(_AXES, offsets, strict=True)):
        low, high = chain.limits[j]
        parent = "base" if j == 0 else f"l{j - 1}"
        text += f'<link name="l{j}">{inertial}</link><joint name="q{j}" type="revolute">'
        text += f'<parent link="{parent}"/>'
        text += f'<child link="l{j}"/><origin xyz="{offset}"/><axis xyz="{axis}"/>'
        text += f'<limit lower="{low}" upper="{high}" effort="1e3" velocity="1e3"/></joint>'
    text += f'<link name="tip">{inertial}</link><joint name="end" type="fixed">'
    text += '<parent link="l3"/><child link="tip"/>'
    text += f'<origin xyz="0 0 {chain.tool[2]}"/></joint></robot>'
    path = Path(tempfile.mkdtemp()) / "robot.urdf"
    path.write_text(text)
    return path


class End:
    """Whether to stop.

    Compiled, and fed with plain arrays: asking costs a peer half a microsecond an iteration.
    """

    def __init__(self, chain: Chain, point: Array, axes: Array) -> None:
        self._fixed = (chain.lengths, chain.tool, point, axes)

    def __call__(self, q: Array) -> bool:
        return _there(q, *self._fixed)


@njit(cache=True)
def _there(q: Array, lengths: Array, tool: Array, point: Array, axes: Array) -> bool:
    p = tip_position(Chain(lengths, tool, np.empty((4, 2)), np.empty(2)), q)
    near = (p[0] - point[0]) ** 2 + (p[1] - point[1]) ** 2 + (p[2] - point[2]) ** 2 <= NEAR_M**2
    return near and norm(rotation_vector(axes @ tip_rotation(q).T)) <= NEAR_RAD


def _pose(point: Array, axes: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = axes, point
    return T


def placo(chain: Chain) -> Solve:
    """Rhoban's placo: a QP per step, joint limits on."""
    import placo as package

    robot = package.RobotWrapper(str(urdf(chain)), package.Flags.ignore_collisions)
    solver = package.KinematicsSolver(robot)
    solver.mask_fbase(True)
    solver.enable_joint_limits(True)
    task = solver.add_frame_task("tip", np.eye(4))
    task.configure("tip", "soft", 1.0, 1.0)

    def solve(point: Array, axes: Array) -> Array:
        task.T_world_frame, end = _pose(point, axes), End(chain, point, axes)
        q = np.zeros(4)
        for _ in range(MOST):
            solver.solve(True)
            robot.update_kinematics()
            q = robot.state.q[7:].copy()
            if end(q):
                break
        return q

    return solve


def mink(chain: Chain) -> Solve:
    """Kevin Zakka's mink over MuJoCo: a QP per step, configuration limit on."""
    import mink as package
    import mujoco

    spec = mujoco.MjSpec.from_file(str(urdf(chain)))
    spec.compiler.fusestatic = False
    model = spec.compile()
    configuration = package.Configuration(model)
    task = package.FrameTask(
        "tip", "body", position_cost=1.0, orientation_cost=0.05, lm_damping=1e-6
    )
    limits = [package.ConfigurationLimit(model)]

    # Alike in pink: two packages with one interface, of which either may be missing.
    def solve(point: Array, axes: Array) -> Array:
        task.set_target(package.SE3.from_matrix(_pose(point, axes)))
        end = End(chain, point, axes)
        for _ in range(MOST):
            velocity = package.solve_ik(configuration, [task], 1.0, "daqp", limits=limits)
            configuration.integrate_inplace(velocity, 1.0)
            if end(configuration.q):
                break
        return configuration.q.copy()

    return solve


def pink(chain: Chain) -> Solve:
    """Stephane Caron's pink over Pinocchio: a QP per step, configuration and velocity limits on."""
    import pink as package
    import pinocchio

    model = pinocchio.buildModelFromUrdf(str(urdf(chain)))
    configuration = package.Configuration(model, model.createData(), np.zeros(4))
    task = package.FrameTask("tip", position_cost=1.0, orientation_cost=0.05, lm_damping=1e-6)

    # Alike in mink: see there.
    def solve(point: Array, axes: Array) -> Array:
        task.set_target(pinocchio.SE3(axes, point))
        end = End(chain, point, axes)
        for _ in range(MOST):
            velocity = package.solve_ik(
                configuration, [task], 1.0, solver="daqp", safety_break=False
            )
            configuration.integrate_inplace(velocity, 1.0)
            if end(configuration.q):
                break
        return configuration.q.copy()

    return solve


def ikpy(chain: Chain) -> Solve:
    """Phylliade's ikpy: scipy's bounded least squares over its own chains."""
    from ikpy.chain import Chain as Package

    robot = Package.from_urdf_file(
        str(urdf(chain)),
        base_elements=["base"],
        active_links_mask=[False, True, True, True, True, False],
    )
    last = np.zeros(6)

    def solve(point: Array, axes: Array) -> Array:
        last[:] = robot.inverse_kinematics_frame(
            _pose(point, axes), initial_position=last, orientation_mode="all"
        )
        return last[1:5].copy()

    return solve


def scipy(chain: Chain) -> Solve:
    """scipy's bounded least squares with our Jacobian.

    Lengths relative to the finger's, as for ours.
    """
    from scipy.optimize import least_squares

    scale, last = 1.0 / max_reach(chain), np.zeros(4)
    p, J = np.empty(3), np.empty((6, 4))

    def solve(point: Array, axes: Array) -> Array:
        def residual(q: Array) -> Array:
            turn = vector_from_rotation(tip_rotation(q) @ axes.T)
            return np.concatenate([scale * (tip_position(chain, q) - point), turn])

        def slope(q: Array) -> Array:
            tip_jacobian(chain, q, p, J)
            return J * np.array([[scale]] * 3 + [[1.0]] * 3)

        start = np.clip(last, chain.limits[:, 0] + 1e-9, chain.limits[:, 1] - 1e-9)
        last[:] = least_squares(
            residual, start, slope, bounds=chain.limits.T, xtol=1e-10, ftol=1e-10, gtol=1e-10
        ).x
        return last.copy()

    return solve


def roboticstoolbox(chain: Chain) -> Solve:
    """Peter Corke's toolbox: its compiled Levenberg-Marquardt.

    Limits are not part of its problem.
    """
    import roboticstoolbox as rtb

    ET, (a, b), c = rtb.ET, chain.lengths[:2], -chain.tool[2]
    robot = rtb.ETS(
        [
            ET.Ry(),
            ET.Rx(flip=True),
            ET.tz(-a),
            ET.Rx(flip=True),
            ET.tz(-b),
            ET.Rx(flip=True),
            ET.tz(-c),
        ]
    )
    robot.qlim = chain.limits.T
    last = np.zeros(4)

    def solve(point: Array, axes: Array) -> Array:
        last[:] = robot.ik_LM(
            _pose(point, axes), q0=last.copy(), tol=1e-9, joint_limits=False, slimit=1, ilimit=MOST
        )[0]
        return last.copy()

    return solve


# Peers whose problem has no limits: their result may still keep them by luck.
WITHOUT_LIMITS = ("roboticstoolbox",)
PACKAGES = {
    "roboticstoolbox": "roboticstoolbox-python",
    "mink": "mink daqp",
    "pin-pink": "pin-pink daqp",
}
PEERS = {
    "placo": placo,
    "mink": mink,
    "pin-pink": pink,
    "roboticstoolbox": roboticstoolbox,
    "ikpy": ikpy,
    "scipy": scipy,
}
