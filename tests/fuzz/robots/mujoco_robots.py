"""Rigid open chains against MuJoCo: torques of ideal motors, and places of the targets with compliant ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from oracles import STEP
from robots import WORLD, Robot, draw
from scipy.optimize import root
from scipy.spatial.transform import Rotation
from stages import write
from tellings import any_telling

SAME_TORQUE = 2e-3  # of the largest, at three quarters of the instants
SAME_PLACE = 2e-2  # of the motion or the error


def in_mujoco(robot: Robot, gravity) -> str:
    """The MJCF of a rigid open chain; motors in the order of the joints, in radians and metres.

    Args:
        gravity: [m/s^2].
    """

    def quat(R) -> str:
        return " ".join(f"{x:.17g}" for x in Rotation.from_matrix(R).as_quat(scalar_first=True))

    def numbers(values) -> str:
        return " ".join(f"{x:.17g}" for x in values)

    def body(k: int) -> str:
        joint = next(j for j in robot.joints if j.body1 == k)
        place, solid = joint.frame0 @ np.linalg.inv(joint.frame1), robot.solids[k]
        kinds = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}
        axis, at = joint.frame1[:3, 2], joint.frame1[:3, 3]
        motor, name = joint.motor or {}, robot.joints.index(joint)
        damping = motor.get("viscousFriction", 0.0) + motor.get("velocityGain", 0.0) * (
            motor.get("dampingOn") == "joint"
        )
        own = (
            ""
            if joint.kind == "fixed"
            else f'<joint name="j{name}" type="{kinds[joint.kind]}" axis="{numbers(axis)}" '
            f'pos="{numbers(at)}" armature="{motor.get("armature", 0.0)}" damping="{damping}"/>'
        )
        sites = "".join(
            f'<site name="t{i}" pos="{numbers(t[1][:3, 3])}"/>' for i, t in enumerate(robot.targets) if t[0] == k
        )
        inertial = (
            f'<inertial mass="{solid.mass:.17g}" pos="{numbers(solid.place[:3, 3])}" '
            f'quat="{quat(solid.place[:3, :3])}" diaginertia="{numbers(solid.moments)}"/>'
        )
        children = "".join(body(j.body1) for j in robot.joints if j.body0 == k)
        at = f'pos="{numbers(place[:3, 3])}" quat="{quat(place[:3, :3])}"'
        return f'<body name="b{k}" {at}>{inertial}{own}{sites}{children}</body>'

    roots = "".join(body(j.body1) for j in robot.joints if j.body0 == WORLD)
    return (
        f'<mujoco><compiler angle="radian" boundmass="0" boundinertia="0"/><option gravity="{numbers(gravity)}"/>'
        f"<worldbody>{roots}</worldbody></mujoco>"
    )


def against_mujoco(seed: int, folder: Path) -> tuple[str, list[str]]:
    """Torques of ideal motors, else places of the targets with compliant ones."""
    import calmotion as cm
    import mujoco

    robot = draw(seed, wild=False, kind="stiff chain")
    driven = [k for k, joint in enumerate(robot.joints) if joint.keys is not None]
    ideal = seed % 2 == 0 or not any(robot.joints[k].motor for k in driven)
    if not driven:
        return "no motors", []
    telling = replace(any_telling(seed), composed="flat", shifted=False)
    result = cm.simulate(
        str(write(robot, telling, folder)), step=STEP / 2, keep=("all",), motors="ideal" if ideal else "authored"
    )
    curves = {int(path.rsplit("/J", 1)[1]): motor for path, motor in result.motors.items()}
    zero = {k: -telling.rolled for k in driven}
    t, q, efforts = (
        result.times,
        np.zeros((len(result.times), len(robot.joints))),
        np.zeros((len(result.times), len(robot.joints))),
    )
    for k, motor in curves.items():
        sign = -1.0 if k in telling.exchanged else 1.0
        q[:, k], efforts[:, k] = sign * motor.output - zero[k], sign * motor.effort
    model = mujoco.MjModel.from_xml_string(in_mujoco(robot, (0, 0, -9.81)))
    if ideal:
        model.dof_armature[:] = model.dof_damping[:] = 0.0
    data = mujoco.MjData(model)
    dof = {k: model.joint(f"j{k}").dofadr[0] for k in driven}
    where = f"mujoco, {'ideal' if ideal else 'compliant'}"
    if ideal:
        return where, _torques(model, data, t, q, efforts, dof)
    return where, _places(robot, telling, result, model, data, q, dof)


def _torques(model, data, t, q, efforts, dof) -> list[str]:
    """Efforts against inverse dynamics; derivatives by differences, which are off where a curve has a knot."""
    import mujoco

    h, joints, off, largest = t[1] - t[0], list(dof), [], 0.0
    places = list(dof.values())
    for n in range(1, len(t) - 1):
        data.qpos[places] = q[n, joints]
        data.qvel[places] = (q[n + 1, joints] - q[n - 1, joints]) / (2.0 * h)
        data.qacc[places] = (q[n + 1, joints] - 2.0 * q[n, joints] + q[n - 1, joints]) / h**2
        mujoco.mj_inverse(model, data)
        expected = data.qfrc_inverse[places]
        off.append(np.abs(expected - efforts[n, joints]).max())
        largest = max(largest, np.abs(expected).max())
    usual = float(np.quantile(off, 0.75))
    return [f"torques {usual:.3g} apart, largest {largest:.3g}"] if usual > SAME_TORQUE * largest else []


def _places(robot, telling, result, model, data, q, dof) -> list[str]:
    import mujoco

    h, t = result.times[1] - result.times[0], result.times
    model.opt.timestep, parts = h / 8, 8
    gains = {k: (robot.joints[k].motor or {}) for k in dof}
    ideal = [k for k in dof if not gains[k] or gains[k]["model"] not in ("drive", "servo")]
    if ideal:
        return []

    def torque(command, rate, qpos, qvel):
        return np.array([
            gains[k]["positionGain"] * (command[k] - qpos[d])
            + (gains[k]["velocityGain"] * (rate[k] - qvel[d]) if gains[k]["dampingOn"] == "error" else 0.0)
            for k, d in dof.items()
        ])  # fmt: skip

    def residual(x):
        data.qpos[list(dof.values())], data.qvel[:], data.qacc[:] = x, 0, 0
        mujoco.mj_inverse(model, data)
        return torque(q[0], np.zeros_like(q[0]), data.qpos, data.qvel) - data.qfrc_inverse[list(dof.values())]

    solved = root(residual, [q[0, k] for k in dof], tol=1e-12)
    data.qpos[list(dof.values())], data.qvel[:] = solved.x, 0
    rates = np.gradient(q, h, axis=0)
    places = np.zeros((len(t), len(robot.targets), 3))
    for n in range(len(t)):
        mujoco.mj_kinematics(model, data)
        places[n] = data.site_xpos
        for i in range(parts if n + 1 < len(t) else 0):
            s = (i + 0.5) / parts
            data.qfrc_applied[list(dof.values())] = torque(
                (1 - s) * q[n] + s * q[n + 1], (1 - s) * rates[n] + s * rates[n + 1], data.qpos, data.qvel
            )
            mujoco.mj_step(model, data)
    back = np.linalg.inv(telling.world)
    found = []
    for path, target in result.targets.items():
        i = int(path.rsplit("/Tip", 1)[1])
        here = target.position @ back[:3, :3].T + back[:3, 3]
        off = np.linalg.norm(here - places[:, i], axis=1).max()
        size = max(np.ptp(places[:, i], axis=0).max(), target.error.max())
        if off > SAME_PLACE * size:
            found.append(f"{path}: {off:.3g} m apart, moves {size:.3g} m, errors {target.error.max():.3g}")
    return found
