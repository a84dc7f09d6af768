"""Synthetic shots with flexible links, ready to be simulated and optimised."""

import numpy as np
from calmotion.model.run import RunSettings
from calmotion.simulation.body_reduction import reduction_for
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.testing import beam_arm, quintic, shot_of
from linkage_arm import SOFT, linkage_arm, performance


def reduced_shot(character, animation, meshes, options):
    """A shot compiled with its bodies reduced to the tolerance of the options."""
    bodies = reduction_for(character, animation, meshes, options).bodies(options.tolerance)
    return compile_shot(character, animation, bodies)


def plastic_shot():
    """Two plastic links that swing."""
    character, meshes = beam_arm(2, length=0.3, thickness=0.014, payload=0.2)
    move, back = quintic(0.8, 0.4, 0.2), quintic(-1.1, 0.35, 0.9)
    return reduced_shot(character, shot_of(lambda t: move(t) + back(t), 2.0, motors=2), meshes, RunSettings())


def soft_linkage_shot():
    """An arm with a four-bar linkage and thin links, with a shake of 0.25 m."""
    character, meshes = linkage_arm(thickness=SOFT)
    return reduced_shot(character, performance(), meshes, RunSettings())


def simulated(made, animation, **settings):
    """The simulation of a character with its meshes: finite, with closed joints and rotations that are rotations.

    Args:
        settings: Of `RunSettings`.
    """
    options = RunSettings(**settings)
    shot = reduced_shot(made[0], animation, made[1], options)
    run = simulate_shot(shot, options, lambda fraction, message: None).before
    motion = run.motion
    parts = (motion.positions, motion.rotations, motion.target_positions, motion.motor_efforts, *motion.elastic)
    assert all(np.all(np.isfinite(part)) for part in parts)
    assert np.abs(np.linalg.norm(motion.rotations, axis=2) - 1.0).max() < 1e-9
    assert run.max_joint_gap < 1e-6
    return run
