"""A faulty arm in MuJoCo, whose fore link is a chain of rigid segments, and what its sensors record."""

import numpy as np
from calmotion.arrays import Array
from calmotion.recordings import ACCELEROMETER, ANGLE, Channel, SensorRecording

from .faulty_arm import DENSITY, FaultyArm, played

SEGMENTS, STIFFER = 6, 3  # of a fore link, and of one whose own frequencies are too high for the step with so many
STEP = 2.5e-4  # [s]
ENCODER, ACCELERATIONS = 150.0, 500.0  # samples a second
# MuJoCo's dry friction is soft, and by default like a damper below some tenths of a radian a second
DRY = 'solreffriction="0.002 1" solimpfriction="0.999 0.999 0.001 0.5 2"'
COUNTS = 4096  # of an encoder a turn
NOISE, BIAS = 0.06, 0.2  # of the accelerometer [m/s^2]


def recorded_in_mujoco(arm: FaultyArm) -> SensorRecording:
    """Encoders and an accelerometer at the load of the real arm.

    Raises:
        ImportError: MuJoCo is not installed.
    """
    import mujoco

    model = mujoco.MjModel.from_xml_string(_mjcf(arm))
    model.opt.timestep = STEP
    data = mujoco.MjData(model)
    rng = np.random.default_rng([arm.seed, 74])
    times = np.arange(0.0, arm.times[-1], STEP)
    command = np.stack([np.interp(times, arm.times, column) for column in played(arm).T], axis=1)
    names = ("yaw", "shoulder", "elbow")
    joints = [model.joint(name) for name in names]
    where, dof = [int(j.qposadr[0]) for j in joints], [int(j.dofadr[0]) for j in joints]
    gain, waves = arm.gains[0], int(rng.integers(14, 50))
    rippled, ripple = int(rng.integers(0, 3)), arm.faults.get("ripple", 0.0)
    _settle(model, data, command[0], where)
    angles, felt = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    for n in range(len(times)):
        data.ctrl[:] = command[n]
        if ripple:
            data.qfrc_applied[dof[rippled]] = gain[rippled] * ripple * np.sin(waves * data.qpos[where[rippled]])
        mujoco.mj_step(model, data)
        angles[n], felt[n] = data.qpos[where], data.sensordata
    return sampled(arm, times + STEP, angles, felt, rng)


def _settle(model: object, data: object, pose: Array, where: list[int]) -> None:
    import mujoco

    data.qpos[where] = pose  # type: ignore[attr-defined]
    data.ctrl[:] = pose  # type: ignore[attr-defined]
    for _ in range(round(1.5 / STEP)):
        mujoco.mj_step(model, data)


def sampled(arm: FaultyArm, times: Array, angles: Array, felt: Array, rng: np.random.Generator) -> SensorRecording:
    """What encoders and the accelerometer say."""
    own = np.arange(0.0, times[-1], 1.0 / ENCODER)
    turn = 2.0 * np.pi / COUNTS
    channels = [
        Channel(ANGLE, f"/Arm/{name}", own, turn * np.round(np.interp(own, times, angles[:, k]) / turn)[:, None])
        for k, name in enumerate(("Yaw", "Shoulder", "Elbow"))
    ]
    own = np.arange(0.0, times[-1], 1.0 / ACCELERATIONS)
    values = np.stack([np.interp(own, times, column) for column in felt.T], axis=1)
    values = values + BIAS * rng.standard_normal(3) + NOISE * rng.standard_normal(values.shape)
    channels.append(Channel(ACCELEROMETER, "/Arm/Load", own, values))
    return SensorRecording("recorded.csv", "", tuple(channels))


def _mjcf(arm: FaultyArm) -> str:
    """The arm in MJCF: half a spring's length of the beam at its root, then equal segments."""
    t, faults = arm.thickness, arm.faults
    gain, damping = arm.gains
    if "servo_gains" in faults:
        damping = damping * faults["servo_gains"] / arm.HEALTHY
    friction = faults.get("friction", 0.0) * gain
    segments = SEGMENTS if arm.frequency < 20.0 else STIFFER
    length = arm.fore / segments
    stiffness = arm.modulus * t**4 / 12.0 / length
    mass = DENSITY * t**2 * length
    across, along = mass * (length**2 + t**2) / 12.0, mass * t**2 / 6.0
    retardation = 2.0 * arm.DAMPING / (2.0 * np.pi * arm.frequency)
    bodies, ends = "", ""
    for k in range(segments):
        own = stiffness * (2.0 if k == 0 else 1.0)
        hinges = "".join(
            f'<joint type="hinge" axis="{axis}" stiffness="{own}" damping="{retardation * own}"/>'
            for axis in ("0 -1 0", "0 0 1")
            # a limit of MuJoCo is as soft as the lightest body behind it, which would be the first segment
            if not faults.get("backlash")
        )
        bodies += (
            f'<body pos="{0.0 if k == 0 else length} 0 0">{hinges}'
            f'<inertial pos="{0.5 * length} 0 0" mass="{mass}" diaginertia="{along} {across} {across}"/>'
        )
        ends += "</body>"
    cube = arm.load * 4.0 * t**2 / 6.0
    load = (
        f'<body pos="{length} 0 0"><inertial pos="0 0 0" mass="{arm.load}" diaginertia="{cube} {cube} {cube}"/>'
        '<site name="load"/></body>'
    )
    m = arm.link_masses[0]
    turning, small = m * (arm.upper**2 + t**2) / 12.0, m * t**2 / 6.0
    width = faults.get("backlash", 0.0)

    def hinge(name: str, axis: str, k: int) -> str:
        own = f'<joint name="{name}" type="hinge" axis="{axis}" frictionloss="{friction[k]}" armature="1e-5" {DRY}/>'
        if not width:
            return own
        # the motor's side with its rotor, and the play between it and the load
        inertia = ROTOR * gain[k] / (2.0 * np.pi * arm.loops[k]) ** 2
        rotor = f'<joint name="{name}" type="hinge" axis="{axis}" armature="{inertia}"/>'
        inside = '<inertial pos="0 0 0" mass="1e-4" diaginertia="1e-7 1e-7 1e-7"/><body>'
        free = (
            f'<joint type="hinge" axis="{axis}" limited="true" range="{-0.5 * width} {0.5 * width}" '
            'solreflimit="0.004 1" solimplimit="0.99 0.999 0.001" armature="1e-5"/>'
        )
        return rotor + inside + free

    closing = "</body>" if width else ""
    inertia = 1e-3
    actuators = "".join(
        f'<general joint="{name}" gainprm="{gain[k]}" biasprm="0 {-gain[k]} {-damping[k]}" biastype="affine" '
        'ctrlrange="-9 9"/>'
        for k, name in enumerate(("yaw", "shoulder", "elbow"))
    )
    return (
        '<mujoco><compiler angle="radian"/><option integrator="implicitfast" gravity="0 0 -9.81">'
        '<flag contact="disable"/>'
        f'</option><worldbody><body name="base">{_rocking(arm)}<inertial pos="0 0 0" mass="0.3" '
        f'diaginertia="{inertia} {inertia} {inertia}"/><body name="post">{hinge("yaw", "0 0 1", 0)}'
        f'<inertial pos="0 0 0" mass="{arm.POST}" diaginertia="1e-3 1e-3 1e-3"/>'
        f'<body name="upper">{hinge("shoulder", "0 -1 0", 1)}<inertial pos="{0.5 * arm.upper} 0 0" mass="{m}" '
        f'diaginertia="{small} {turning} {turning}"/><body name="fore" pos="{arm.upper} 0 0">'
        f"{hinge('elbow', '0 -1 0', 2)}"
        f'<inertial pos="0 0 0" mass="1e-4" diaginertia="1e-7 1e-7 1e-7"/>{bodies}{load}{ends}'
        f"</body>{closing}</body>{closing}"
        f"</body>{closing}</body></worldbody><actuator>{actuators}</actuator>"
        '<sensor><accelerometer site="load"/></sensor></mujoco>'
    )


def _rocking(arm: FaultyArm) -> str:
    """The hinges of a base that rocks, whose frequency is that of the arm about as far as it reaches on average."""
    if "base" not in arm.faults:
        return ""
    reach, masses = arm.upper + arm.fore, arm.link_masses
    about = arm.load * (0.7 * reach) ** 2 + masses[1] * (arm.upper + 0.3 * arm.fore) ** 2
    about += masses[0] * arm.upper**2 / 3.0
    own = (2.0 * np.pi * arm.faults["base"]) ** 2 * about
    loss = 2.0 * 0.04 * np.sqrt(own * about)
    return "".join(
        f'<joint type="hinge" axis="{axis}" pos="0 0 -0.05" stiffness="{own * factor}" damping="{loss}"/>'
        for axis, factor in (("1 0 0", 1.0), ("0 1 0", 1.25))
    )


ROTOR = 0.15  # inertia of a rotor, of that which its joint carries, where there is play between both
