"""Whatever is drawn is simulated to its end in numbers, or refused with a reason and a remedy."""

import numpy as np
from calmotion import ShotError
from hypothesis import event, given
from hypothesis import strategies as st
from random_shots import beams, linkages, lumps, shots, simulated

EXTREME = st.one_of(lumps(4.0), beams())


@given(st.one_of(shots(stuff=EXTREME), linkages()))
def test_a_shot_ends_in_numbers_or_is_refused_with_a_remedy(shot):
    try:
        result = simulated(shot)
    except ShotError as error:
        event("refused")
        assert error.problem and error.remedy
        assert error.path in {part.path for part in (shot.character, *shot.character.bodies, *shot.character.joints)}
        return
    event("simulated")
    motion, simulation = result.before.motion, result.before
    parts = (
        motion.positions, motion.rotations, motion.motor_values, motion.motor_efforts, motion.target_positions,
        motion.target_rotations, motion.joint_forces, motion.joint_moments, *motion.elastic,
        simulation.position_errors, simulation.rotation_errors,
    )  # fmt: skip
    assert all(np.all(np.isfinite(part)) for part in parts)
    assert np.abs(np.linalg.norm(motion.rotations, axis=2) - 1.0).max() < 1e-9
    assert simulation.max_joint_gap < 1e-6
