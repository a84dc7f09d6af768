"""What never turns hangs by welds, sliders and motors that keep their angle."""

from dataclasses import replace

import numpy as np
from calmotion.model import MovingFrame, Track
from calmotion.multibody.model.topology import span_tree
from calmotion.tolerance.simplification.rotating_bodies import turning_of
from simplification_shots import arm_with_head, gantry, plastic_arm


def _found(shot, changes=True):
    return turning_of(shot.character, shot.animation, span_tree(shot.character), changes)


def test_a_carriage_and_bodies_fixed_to_it_do_not_rotate():
    shot = gantry(2)
    found = _found(shot)
    by_name = dict(zip([b.path.split("/")[-1] for b in shot.character.bodies], found, strict=True))
    for name in ("Carriage", "Mast0", "Mast1"):
        assert not by_name[name].turns
    assert by_name["Load0"].turns and "flexible" in by_name["Load0"].why


def test_bodies_on_a_body_that_is_simulated_as_rigid_do_not_rotate():
    shot = gantry(1)
    bodies = tuple(replace(body, stiff=True) for body in shot.character.bodies)
    found = _found(replace(shot, character=replace(shot.character, bodies=bodies)))
    assert not any(item.turns for item in found)


def test_active_motors_and_motors_that_may_change_rotate_bodies():
    shot = plastic_arm()
    assert all(item.turns for item in _found(shot))
    constant = tuple(Track(t.times, np.full_like(t.values, 0.3)) for t in shot.animation.tracks)
    still = replace(shot, animation=replace(shot.animation, tracks=constant, current=constant))
    assert all("may rotate" in item.why or "attached" in item.why for item in _found(still))
    simulated = _found(still, changes=False)
    assert not simulated[0].turns and simulated[1].turns  # the second hangs from what bends


def test_locked_and_idle_motors_do_not():
    shot = plastic_arm()
    constant = tuple(Track(t.times, np.zeros_like(t.values)) for t in shot.animation.tracks)
    for change in ({"optimize": False}, {"idle": True}):
        motors = tuple(replace(m, **change) for m in shot.character.motors)
        still = replace(
            shot, character=replace(shot.character, motors=motors),
            animation=replace(shot.animation, tracks=constant, current=constant),
        )  # fmt: skip
        assert not _found(still)[0].turns


def test_only_the_optimised_curve_moves():
    shot = plastic_arm()
    constant = tuple(Track(t.times, np.zeros_like(t.values)) for t in shot.animation.tracks)
    shown = replace(shot, animation=replace(shot.animation, tracks=constant))  # `current` still swings
    assert _found(shown, changes=False)[0].turns


def test_rotating_roots():
    shot = gantry(1)
    times = np.array([0.0, 1.0])
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    for rotations, turns in ((still, False), (np.array([[1.0, 0, 0, 0], [0.9, 0.0, 0.0, 0.436]]), True)):
        frame = MovingFrame(0, times, np.zeros((2, 3)), rotations)
        moved = replace(shot, animation=replace(shot.animation, moving=(frame,)))
        assert _found(moved)[0].turns == turns


def test_bodies_that_hang_from_free_joints_rotate():
    shot = arm_with_head()
    motors = shot.character.motors[:-1]
    free = replace(shot, character=replace(shot.character, motors=motors))
    assert "freely" in _found(free)[-1].why
