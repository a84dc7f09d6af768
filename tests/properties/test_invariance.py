"""Results do not depend on how a shot is told: the order of its bodies, its place in the world, the size of its units.

Positions are compared over the reach of the robot, rotations in radians, and the effort of each motor over the largest
of that motor.
"""

from dataclasses import replace

import numpy as np
from calmotion import ShotError
from hypothesis import assume, event, given
from hypothesis import strategies as st
from likenesses import Units, apart, in_units, moved, reach, reordered
from random_shots import STEP, Frame, beams, linkages, lumps, quaternion, rotation_of, shots, simulated, triples
from scipy.spatial.transform import Rotation

SAME = 1e-9
PRE_ROLL = 0.25
# balls and sliders rarely rest anywhere
HELD = ("fixed", "revolute motor", "prismatic motor")
SHOTS = st.one_of(shots(kinds=(*HELD, "hinge")), shots(kinds=HELD), linkages())


def motion_of(shot, **options):
    """Its motion, or None where it is refused."""
    try:
        return simulated(shot, **({"pre_roll": PRE_ROLL} | options)).before.motion
    except ShotError:
        return None


def both(shot, other, **options):
    """Motions of two shots, which have the same fate."""
    one, two = motion_of(shot), motion_of(other, **options)
    assert (one is None) == (two is None)
    event("refused" if one is None else "simulated")
    assume(one is not None)
    return one, two


@given(SHOTS, st.randoms(use_true_random=False))
def test_the_order_of_bodies_joints_and_motors_does_not_matter(shot, random):
    character = shot.character
    parts = (character.bodies, character.joints, character.motors)
    bodies, joints, motors = (random.sample(range(len(part)), len(part)) for part in parts)
    one, other = both(shot, reordered(shot, bodies, joints, motors))
    off = apart(character, one, other, reach(character), motors)
    assert max(off.values()) < SAME, off


@given(SHOTS, triples(3.0), triples(4.0))
def test_the_place_in_the_world_does_not_matter(shot, turn, place):
    by = Frame(np.array(place), quaternion(Rotation.from_rotvec(turn)))
    one, other = both(shot, moved(shot, by))
    back = rotation_of(by).inv()
    turned = back * Rotation.from_quat(other.target_rotations[:, 0], scalar_first=True)
    other = replace(
        other,
        target_positions=back.apply(other.target_positions[:, 0] - by.position)[:, None],
        target_rotations=quaternion(turned)[:, None],
    )
    off = apart(shot.character, one, other, reach(shot.character) + np.linalg.norm(by.position))
    assert max(off.values()) < SAME, off


POWERS = st.sampled_from((0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0))


# Nothing hangs free here: where it may come to rest in several poses, which one is found depends on pseudo time steps
# that are seconds. And what bends by more than its length has several equilibria as well: the beams are stiff enough.
@given(shots(kinds=HELD, stuff=st.one_of(lumps(1.0), beams(moduli=(1e10, 1e11)))), st.builds(Units, *[POWERS] * 3))
def test_the_size_of_units_does_not_matter(shot, units):
    one, other = both(shot, in_units(shot, units), step=STEP * units.time, pre_roll=PRE_ROLL * units.time)
    linear = np.array([motor.linear for motor in shot.character.motors], dtype=bool)
    unit = np.where(linear, units.of(1, 1, -2), units.of(2, 1, -2))
    other = replace(
        other, target_positions=other.target_positions / units.length, motor_efforts=other.motor_efforts / unit
    )
    off = apart(shot.character, one, other, reach(shot.character))
    assert max(off.values()) < SAME, off
