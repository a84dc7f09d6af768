"""Whatever is drawn and can be simulated keeps the tolerance that is asked for, by a step that follows from it."""

from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.simulation import simulate_to_tolerance
from calmotion.tolerance.step_error import distance, frames_of_result, simulate_at
from hypothesis import assume, event, given
from hypothesis import strategies as st
from random_shots import linkages, shots

TOLERANCE, FINE = 1e-3, 1 / 3840


@given(st.one_of(shots(), linkages()))
def test_the_tolerance_is_kept(shot):
    character, animation = shot.character, shot.animation
    bodies = reduce_bodies(character, span_tree(character), shot.meshes)
    try:
        options = RunSettings(tolerance=TOLERANCE)
        result = simulate_to_tolerance(
            compile_shot(character, animation, bodies), options, lambda fraction, message: None
        )
        fine, finer = (
            simulate_at(compile_shot(character, animation, bodies), RunSettings(), h).positions
            for h in (FINE, 0.5 * FINE)
        )
    except ShotError:
        event("refused")
        assume(False)
    limit = finer + (finer - fine) / 3.0
    assume(distance(limit, finer) < TOLERANCE)  # the limit is known
    assert distance(frames_of_result(result, animation.frame_times).positions, limit) < TOLERANCE
