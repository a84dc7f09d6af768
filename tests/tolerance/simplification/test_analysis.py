"""What is decided, on shots each of which has something that it does not need; each decision against a run without."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model.model_choice import KINDS, OFF, ON
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.body_reduction import load_envelopes
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.simplification.analysis import analyse
from calmotion.tolerance.step_error import distance, simulate_at
from simplification_shots import arm_with_head, clevis_arm, gantry, mixed_arm, plastic_arm

FAST = RunSettings(step=1 / 120)


def _analyse(shot, forced=None, changes=False, options=FAST):
    return analyse(shot.character, shot.animation, options, forced or {}, changes)


def _simulated(shot, character):
    bodies = None
    if any(body.simulated_flexible for body in character.bodies):
        loads = load_envelopes(character, shot.animation, shot.meshes, FAST)
        bodies = reduce_bodies(character, span_tree(character), shot.meshes, None, loads)
    return simulate_at(compile_shot(character, shot.animation, bodies), FAST, 1 / 240).positions


def _rows(choices, kind):
    return [row for row in choices.rows if row.kind == kind]


@pytest.mark.parametrize("shot", [mixed_arm(), plastic_arm()], ids=["steel and plastic", "plastic"])
def test_all_flexible_bodies_keep_their_finite_elements_unless_the_user_forces_them(shot):
    flexible = [body.flexible is not None for body in shot.character.bodies]
    for options in (FAST, replace(FAST, tolerance=1.0)):
        choices = _analyse(shot, options=options)
        assert [body.simulated_flexible for body in choices.character.bodies] == flexible and not _rows(
            choices, "bodies"
        )
    kept = _analyse(shot, {"bodies": ON})
    assert [body.simulated_flexible for body in kept.character.bodies] == flexible
    assert all(row.needed and row.forced for row in _rows(kept, "bodies"))


def test_bodies_that_are_forced_to_be_rigid_have_the_mass_of_their_geometry():
    choices = _analyse(mixed_arm(), {"bodies": OFF})
    assert not any(body.simulated_flexible for body in choices.character.bodies)
    assert choices.character.bodies[0].mass.mass == pytest.approx(7800 * 0.3 * 0.08**2)
    assert len(_rows(choices, "bodies")) == 2 and all(row.forced for row in _rows(choices, "bodies"))


def test_a_body_whose_mass_is_not_known_stays_flexible():
    shot = mixed_arm()
    bodies = tuple(replace(body, tets=None) for body in shot.character.bodies)
    bare = replace(shot, character=replace(shot.character, bodies=bodies))
    forced = _analyse(bare, {"bodies": OFF})
    assert forced.character.bodies[0].simulated_flexible and "no geometry" in _rows(forced, "bodies")[0].why


def test_everything_can_be_forced_off_and_on():
    shot = plastic_arm()
    off, on = _analyse(shot, dict.fromkeys(KINDS, OFF)), _analyse(shot, dict.fromkeys(KINDS, ON))
    assert not any(b.simulated_flexible for b in off.character.bodies) and all(
        b.non_rotating for b in off.character.bodies
    )
    assert on.character.bodies[0].simulated_flexible and not any(b.non_rotating for b in on.character.bodies)
    flexible = on.character.bodies[0].flexible
    assert flexible.elasticity == "stvk" and flexible.modes_share < 1.0 and flexible.pairs_share == 0.0
    assert off.character.bodies[0].flexible.elasticity == "linear"
    assert all(row.forced for row in (*_rows(on, "bodies"), *_rows(off, "bodies"), *_rows(on, "turning")))
    assert on.choice("motors") == ON


def test_the_second_pins_of_a_clevis_are_removed_and_the_motion_is_the_same():
    shot = clevis_arm(2)
    choices = _analyse(shot)
    assert [j.redundant for j in choices.character.joints] == [False, True, False, True, False, False]
    full = _analyse(shot, {"loops": ON}).character
    assert not any(j.redundant for j in full.joints)
    assert distance(_simulated(shot, choices.character), _simulated(shot, full)) < 1e-9


def test_joints_of_closed_chains_with_flexible_bodies_are_kept():
    shot = clevis_arm(2)
    bodies = list(shot.character.bodies)
    bodies[0] = replace(bodies[0], flexible=bodies[2].flexible)  # which is not meshed: the analysis asks before that
    kept = _analyse(replace(shot, character=replace(shot.character, bodies=tuple(bodies))))
    assert [j.redundant for j in kept.character.joints][:4] == [False, False, False, True]


def test_the_carriage_and_the_mast_of_a_gantry_do_not_rotate():
    shot = gantry(1)
    choices = _analyse(shot)
    non_rotating = [body.non_rotating for body in choices.character.bodies]
    assert non_rotating[:2] == [True, True]
    full = _analyse(shot, {"turning": ON}).character
    assert distance(_simulated(shot, choices.character), _simulated(shot, full)) < 1e-10


def test_motors_that_move_no_target_are_idle_in_an_optimisation_alone():
    shot = arm_with_head()
    assert [m.idle for m in _analyse(shot, changes=True).character.motors] == [False, False, True, True]
    assert not any(m.idle for m in _analyse(shot).character.motors)
    assert not any(m.idle for m in _analyse(shot, {"motors": ON}, True).character.motors)
    locked = tuple(replace(m, optimize=k > 1) for k, m in enumerate(shot.character.motors))
    only = replace(shot, character=replace(shot.character, motors=locked))
    assert not any(m.idle for m in _analyse(only, changes=True).character.motors)


def test_a_still_of_one_frame_needs_no_decision():
    shot = plastic_arm()
    still = replace(shot, animation=replace(shot.animation, frame_times=np.zeros(1)))
    assert _analyse(still).rows == ()


def test_targets_that_do_not_move_are_named():
    shot = mixed_arm()
    moving = _analyse(shot, changes=True).notes
    root = shot.character.joints[shot.character.motors[0].joint]
    at_hinge = replace(shot.character.targets[0], body=root.body1, frame=root.frame1)
    still = replace(shot, character=replace(shot.character, targets=(at_hinge,)))
    (note,) = _analyse(still, changes=True).notes
    assert moving == () and note.startswith(f"target {at_hinge.path} does not move")
