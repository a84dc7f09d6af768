"""Synthetic shots with flexible links, ready to be simulated and optimised."""

from __future__ import annotations

from calmotion.benchmarks.scenes.beam_arm import beam_arm, quintic, shot_of
from calmotion.shot.run import RunSettings
from calmotion.simulation.body_reduction import reduced_shot
from linkage_arm import SOFT, linkage_arm, performance


def plastic_shot():
    """Two plastic links that swing."""
    character, meshes = beam_arm(2, length=0.3, thickness=0.014, payload=0.2)
    move, back = quintic(0.8, 0.4, 0.2), quintic(-1.1, 0.35, 0.9)
    return reduced_shot(character, shot_of(lambda t: move(t) + back(t), 2.0, motors=2), meshes, RunSettings())


def soft_linkage_shot():
    """An arm with a four-bar linkage and thin links, with a shake of 0.25 m."""
    character, meshes = linkage_arm(thickness=SOFT)
    return reduced_shot(character, performance(), meshes, RunSettings())
