"""What a rigid robot does with the curves of a shot, for comparison with what USD composes."""

import numpy as np
from calmotion.model import MotorCurve, Result, Simulation, Track
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.report import performed_motion
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.skeletons import bound_skeletons
from calmotion.usd.writing.bake import simulated_motion
from pxr import Usd, UsdGeom


def performed(character, animation, tracks):
    """Motion of the rigid robot with tracks."""
    prepared = prepare(compile_shot(character, animation, None), RunSettings(step=1 / 120))
    return performed_motion(prepared, sample_curves(tracks, prepared.grid))


def curves_of(animation, bumps):
    """Curves of a result: the animation, and `bumps[k]` of the size of a bump on motor k."""
    times, found = animation.frame_times, []
    for k, track in enumerate(animation.tracks):
        bump = bumps.get(k, 0.0) * np.sin(np.pi * times / times[-1]) ** 2
        values = np.interp(times, track.times, track.values) + bump
        found.append(MotorCurve(k, k in bumps, times[::2], values, abs(bumps.get(k, 0.0))))
    return tuple(found)


def tracks_of(animation, curves):
    """The curves of a result as tracks."""
    return tuple(Track(animation.frame_times, curve.frame_values) for curve in curves)


def result_with(character, animation, bumps) -> Result:
    """A result whose curves have bumps; nothing in it is simulated."""
    curves = curves_of(animation, bumps)
    motion = performed(character, animation, tracks_of(animation, curves))
    shape = motion.target_positions.shape[:2]
    simulation = Simulation(motion, np.zeros(shape), np.zeros(shape), 0, 0.0, 0.0)
    return Result(
        motion, simulation, simulation, tuple(None for _ in character.bodies), (), curves, 0.0, 0.0,
        0.0, 1 / 120, 0.0, 0, performed=motion,
    )  # fmt: skip


def worst_gap(path, character, animation, tracks=None) -> tuple[float, float]:
    """How far, over all frames and bodies, the rigid robot is from what USD composes: [m], and in rotation matrices."""
    stage = Usd.Stage.Open(str(path))
    meters = UsdGeom.GetStageMetersPerUnit(stage)
    motion = simulated_motion(performed(character, animation, tracks or animation.tracks), animation.frame_times)
    start, rate = stage.GetStartTimeCode(), stage.GetTimeCodesPerSecond()
    far, turned = 0.0, 0.0
    for n, time in enumerate(motion.times):
        cache = UsdGeom.XformCache(start + rate * time)
        for k, body in enumerate(character.bodies):
            world = np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(body.path)))
            far = max(far, float(np.linalg.norm(world[3, :3] * meters - motion.positions[n, k])))
            axes = world[:3, :3] / np.linalg.norm(world[:3, :3], axis=1)[:, None]
            w, *v = motion.rotations[n, k]
            ours = rotation(w, np.array(v))
            turned = max(turned, float(np.abs(axes.T - ours).max()))
    return far, turned


def followed(path, robot):
    """How far the robot is from the skeleton, over all frames and links: [m], and in rotation matrices."""
    character, animation, _ = read_shot(str(path))
    motion = simulated_motion(performed(character, animation, animation.tracks), animation.frame_times)
    stage = Usd.Stage.Open(str(path))
    meters = UsdGeom.GetStageMetersPerUnit(stage)
    (skeleton,) = bound_skeletons(stage)
    start, rate = stage.GetStartTimeCode(), stage.GetTimeCodesPerSecond()
    links = {name.split("/")[-1]: k for k, name in enumerate(skeleton.joints)}
    far, turned = 0.0, 0.0
    for n, time in enumerate(motion.times):
        code = start + rate * time
        worlds = skeleton.placement(code) @ skeleton.in_skeleton(skeleton.locals_at(code))
        for b, body in enumerate(character.bodies):
            joint = links.get(body.path.split("/")[-1])
            if joint is None:
                continue  # a servo
            w, *v = motion.rotations[n, b]
            axes = worlds[joint, :3, :3] / np.linalg.norm(worlds[joint, :3, :3], axis=0)
            far = max(far, float(np.linalg.norm(worlds[joint, :3, 3] * meters - motion.positions[n, b])))
            turned = max(turned, float(np.abs(axes - rotation(w, np.array(v))).max()))
    assert any(body.path.startswith(robot) for body in character.bodies)
    return far, turned


def rotation(w, v):
    """Rotation matrix of a unit quaternion, by Rodrigues."""
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2.0 * w * K + 2.0 * K @ K
