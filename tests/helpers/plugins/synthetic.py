"""A small character whose motion is known in closed form, for plugins that only show results.

A fixed base, a box link that turns about z and bends by one mode (x / L)^2 along y, and a rigid ball at its tip.
"""

import dataclasses

import numpy as np
from calmotion.model import (
    WORLD,
    Animation,
    Body,
    Character,
    ElasticMaterial,
    FlexibleSettings,
    Frame,
    Joint,
    MassProperties,
    ModeTable,
    Motion,
    Motor,
    MotorCurve,
    OptimizerStep,
    Result,
    Retimed,
    SearchRecord,
    Simplification,
    Simulation,
    Skin,
    SurfaceMesh,
    Target,
    Track,
)
from calmotion.model.tempo import Stretch, TempoReport, TimeMap

LENGTH = 0.5
FRAME_RATE = 24.0
FRAMES = 25
STEP = 0.005
PRE_ROLL = 0.2
SHAKE, CALM = 0.03, 0.002
QUADS = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def box(low, high):
    """Points and outward triangles of a box."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    points = [
        (x0, y0, z0),
        (x1, y0, z0),
        (x1, y1, z0),
        (x0, y1, z0),
        (x0, y0, z1),
        (x1, y0, z1),
        (x1, y1, z1),
        (x0, y1, z1),
    ]
    triangles = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
    return np.array(points, dtype=float), np.array(triangles, dtype=np.int32)


def frame(*position):
    return Frame(np.array(position, dtype=float), np.array([1.0, 0.0, 0.0, 0.0]))


def character():
    base_points, triangles = box((-0.05, -0.05, -0.2), (0.05, 0.05, 0.0))
    link_points, _ = box((0.0, -0.01, -0.01), (LENGTH, 0.01, 0.01))
    ball_points, _ = box((-0.03, -0.03, -0.03), (0.03, 0.03, 0.03))
    guide, _ = box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    mass = MassProperties(0.5, np.zeros(3), 1e-3 * np.eye(3))
    plastic = ElasticMaterial("/Robot/Plastic", 2e9, 0.4, 1100.0)
    bodies = (
        Body(
            "/Robot/Base",
            frame(0, 0, 0),
            mass,
            (SurfaceMesh("/Robot/Base/Box", base_points, triangles, (0.1, 0.1, 0.1)),),
        ),
        Body(
            "/Robot/Link",
            frame(0, 0, 0),
            None,
            (SurfaceMesh("/Robot/Link/Beam", link_points, triangles, (0.8, 0.6, 0.2), displaced=8),),
            flexible=FlexibleSettings(plastic),
        ),
        Body(
            "/Robot/Tip",
            frame(LENGTH, 0, 0),
            mass,
            (
                SurfaceMesh("/Robot/Tip/Ball", ball_points, triangles, (0.6, 0.0, 0.0)),
                SurfaceMesh("/Robot/Tip/Guide", guide, triangles, None, visible=False),
            ),
        ),
    )
    joints = (
        Joint("/Robot/Joints/Mount", "fixed", WORLD, 0, frame(0, 0, 0), frame(0, 0, 0)),
        Joint("/Robot/Joints/Swing", "revolute", 0, 1, frame(0, 0, 0), frame(0, 0, 0), -2.0, 2.0),
        Joint("/Robot/Joints/Weld", "fixed", 1, 2, frame(LENGTH, 0, 0), frame(0, 0, 0)),
    )
    motors = (Motor(1, "/Robot/Joints/Swing", "drive:angular:physics:targetPosition", max_velocity=6.0),)
    targets = (Target("/Robot/Tip/Target", 2, frame(0, 0, 0), 1.0, 0.05),)
    return Character("/Robot", bodies, joints, motors, targets, np.array([0.0, 0.0, -9.81]))


def angle(times):
    """The animated angle [rad]: a smooth quarter turn in half a second."""
    s = np.clip(times / 0.5, 0.0, 1.0)
    return 0.5 * np.pi * (3 * s**2 - 2 * s**3)


def bend(times, amplitude):
    """Displacement of the tip in the link's frame [m]: a decaying 4 Hz vibration."""
    t = np.maximum(times, 0.0)
    return amplitude * np.exp(-2.0 * t) * np.sin(2.0 * np.pi * 4.0 * t)


def motion(amplitude, offset=0.0):
    times = np.arange(-round(PRE_ROLL / STEP), round((FRAMES - 1) / FRAME_RATE / STEP) + 1) * STEP
    values = angle(times) + offset * np.sin(np.pi * np.clip(times, 0.0, 1.0))
    tip = bend(times, amplitude)
    count, zero = len(times), np.zeros(len(times))
    turn = np.column_stack([np.cos(values / 2), zero, zero, np.sin(values / 2)])
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    position = np.column_stack(
        [LENGTH * np.cos(values) - tip * np.sin(values), LENGTH * np.sin(values) + tip * np.cos(values), zero]
    )
    return Motion(
        times=times,
        positions=np.stack([np.zeros((count, 3)), np.zeros((count, 3)), position], axis=1),
        rotations=np.stack([still, turn, turn], axis=1),
        elastic=(np.zeros((count, 0)), tip[:, None], np.zeros((count, 0))),
        motor_values=values[:, None],
        motor_efforts=10.0 * tip[:, None],
        target_positions=position[:, None],
        target_rotations=turn[:, None],
        joint_forces=np.stack([k + np.column_stack([tip, values, zero]) for k in range(3)], axis=1),
        joint_moments=np.stack([k - np.column_stack([tip, values, zero]) for k in range(3)], axis=1),
    )


def simulation(amplitude, reference, offset=0.0):
    moved = motion(amplitude, offset)
    errors = np.linalg.norm(moved.target_positions - reference.target_positions, axis=-1)
    return Simulation(moved, errors, 2.0 * errors, 400, 1e-12, 0.1)


def animation():
    times = np.arange(FRAMES) / FRAME_RATE
    track = (Track(times, angle(times)),)
    return Animation(times, track, track)


def result(optimized=True):
    reference = motion(0.0)
    link, _ = box((0.0, -0.01, -0.01), (LENGTH, 0.01, 0.01))
    modes = np.zeros((8, 3, 1))
    modes[:, 1, 0] = (link[:, 0] / LENGTH) ** 2
    frames = animation().frame_times
    curve = MotorCurve(0, True, frames[::4], angle(frames) + 0.01 * np.sin(np.pi * frames), 0.01)
    return Result(
        reference=reference,
        before=simulation(SHAKE, reference),
        after=simulation(CALM, reference, 0.01) if optimized else None,
        skins=(None, Skin((modes,)), None),
        modes=(ModeTable(1, np.array([4.0]), 120, 300, 0.2),),
        curves=(curve,) if optimized else (),
        objective_before=1e-2,
        objective_after=1e-5 if optimized else None,
        search=SearchRecord(
            tuple(OptimizerStep(10.0 ** (-2 - k), 10.0 ** (-1 - k), 1 + k, 20 * k) for k in range(4)), 7, 3, 5, 4, 60
        )
        if optimized
        else SearchRecord(),
        wall_s=1.5,
        step_s=STEP,
        pre_roll_s=PRE_ROLL,
        dof=19,
        left_out=(Simplification("modes above 40 Hz", "the motion does not excite them", 2e-5),),
    )


def retimed_result():
    """An optimised result that is a tenth slower at its end, because of its first motor's speed."""
    tempo = TimeMap(np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 9) + 0.1 * np.linspace(0.0, 1.0, 9) ** 2)
    report = TempoReport(1.0, 0.08, (Stretch(0.2, 0.8, 1.2, ((0, "velocity"),)),), ((0.5, 0.02),))
    performed = Retimed(dataclasses.replace(animation(), tempo=tempo), character(), report)
    return dataclasses.replace(result(), retimed=performed)
