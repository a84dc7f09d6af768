"""Motors that are geared to others: unknowns belong to the motors that lead, and curves to all."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.model.character import Character


def leaders(character: Character) -> IntArray:
    """Motors whose curves may change and follow no other; not those that are idle."""
    own = [motor.optimize and not motor.idle and motor.follows is None for motor in character.motors]
    return np.flatnonzero(own).astype(np.int32)


def coupling_of(character: Character, motors: IntArray) -> Array:
    """By how much each motor changes with each of `motors`, shape [M, m]."""
    coupling = np.zeros((len(character.motors), len(motors)))
    coupling[motors, np.arange(len(motors))] = 1.0
    for k, motor in enumerate(character.motors):
        if motor.follows is not None:
            coupling[k] = motor.follows.ratio * coupling[motor.follows.leader]
    return coupling
