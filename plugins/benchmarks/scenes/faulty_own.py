"""A faulty arm in our own simulator, with another mesh, step and integrator than those of its model."""

from dataclasses import replace

import numpy as np
from calmotion.model import SERVO, Motor, RunSettings, Track
from calmotion.multibody import Workspace, joint_values
from calmotion.recordings import SensorRecording
from calmotion.simulation import CompiledShot, compile_shot, prepare, run_forward
from calmotion.support import rotation_from_quaternion
from scipy.interpolate import make_interp_spline

from .faulty_arm import FaultyArm, played
from .faulty_mujoco import sampled

STEP, CELLS, ACROSS = 1e-3, 18, 3
POSSIBLE = ("links", "servo_gains", "friction", "stream", "delay", "ripple")  # faults that the simulator has


def recorded_by_us(arm: FaultyArm) -> SensorRecording:
    """Encoders and an accelerometer at the load of the real arm."""
    rng = np.random.default_rng([arm.seed, 75])
    shot = _real(arm, rng)
    settings = RunSettings(step=STEP, integrator="generalized-alpha", pre_roll=0.0)
    prepared = prepare(shot, settings)
    grid, model = prepared.grid, prepared.model
    command = np.stack([np.interp(grid.times, arm.times, column) for column in _sent(arm, rng).T], axis=1)
    run = run_forward(
        model, Workspace.for_system(model.system), command, np.gradient(command, grid.h, axis=0), grid.h,
        prepared.world, integrator=settings.scheme,
    )  # fmt: skip
    values = joint_values(model.system, model.motor, shot.character.motors, run.trajectory.states.u, run.joint_angles)
    R = rotation_from_quaternion(run.target_rotations[:, 0])
    felt = make_interp_spline(grid.times, run.target_positions[:, 0], k=5).derivative(2)(grid.times)
    felt = np.einsum("tij,ti->tj", R, felt - np.asarray(shot.character.gravity))
    return sampled(arm, grid.times, model.motor_values(values), felt, rng)


def _real(arm: FaultyArm, rng: np.random.Generator) -> CompiledShot:
    """The arm as it is."""
    shot = arm.shot(CELLS, ACROSS, real=True)
    factor = arm.faults.get("servo_gains", arm.HEALTHY) / arm.HEALTHY
    lost = arm.faults.get("friction", 0.0)

    def motor(own: Motor) -> Motor:
        rotor = replace(own.rotor, armature=1e-5, friction=lost * own.position_gain, friction_speed=0.01)
        return replace(own, model=SERVO, velocity_gain=factor * own.velocity_gain, rotor=rotor)

    character = replace(shot.character, motors=tuple(motor(own) for own in shot.character.motors))
    return compile_shot(character, _fine(arm, shot), shot.bodies)


def _fine(arm: FaultyArm, shot: CompiledShot):  # type: ignore[no-untyped-def]
    """Tracks that last as long as the command."""
    tracks = tuple(Track(arm.times[[0, -1]], arm.command[[0, -1], k]) for k in range(3))
    return replace(shot.animation, tracks=tracks, current=tracks)


def _sent(arm: FaultyArm, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    """Commands with what ripple makes of them."""
    command, size = played(arm), arm.faults.get("ripple", 0.0)
    rippled, waves = int(rng.integers(0, 3)), int(rng.integers(14, 50))
    command = command.copy()
    gain, damping = arm.gains
    # teeth are where the joint is, which lags behind its command
    late = arm.times - damping[rippled] / gain[rippled]
    command[:, rippled] += size * np.sin(waves * np.interp(late, arm.times, arm.command[:, rippled]))
    return command
