"""The public front of the multibody system: models from Python, simulated and differentiated, and its tutorial."""

import re

import calmotion.multibody as mb
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.multibody.model.model import body_anchors, rigid_body
from calmotion.multibody.model.topology import span_tree

STEP = 2e-3


def pendulum(**motor):
    """A rod of 1 kg and 1 m about the y axis, level at zero; driven where a motor is described."""
    rod = mb.Mechanism()
    link = rod.body("rod", 1.0, center=(0.5, 0, 0), inertia=np.diag([1e-4, 1 / 12, 1 / 12]))
    hinge = rod.joint("revolute", mb.WORLD, link, position=(0, 0, 0), axis=(0, -1, 0))
    if motor:
        rod.motor(hinge, **motor)
    rod.target(link, position=(1, 0, 0))
    return rod.compile()


def test_the_tutorial_runs_and_its_derivatives_are_exact(repository):
    text = (repository / "docs" / "tutorial_multibody.md").read_text()
    names: dict = {}
    for number, block in enumerate(re.findall(r"```python\n(.*?)```", text, re.DOTALL)):
        exec(compile(block, f"block {number} of the tutorial", "exec"), names)
    assert names["error"] < 1e-6
    assert abs(names["forward"] - names["backward"]) < 1e-11 * abs(names["forward"])


def test_a_drive_gives_a_pendulum_the_frequency_of_its_spring():
    model = pendulum(model="drive", position_gain=300.0)
    frequencies, _ = mb.natural_modes(model, np.array([-np.pi / 2]))  # hanging
    expected = np.sqrt((300.0 + 9.81 * 0.5) / (1 / 12 + 0.25)) / (2 * np.pi)
    assert frequencies[-1] == pytest.approx(expected, rel=1e-9)


def test_a_drive_that_damps_the_joint_lags_behind_a_steady_rate_by_the_ratio_of_its_gains():
    spinning = mb.Mechanism(gravity=(0, 0, 0))
    disc = spinning.body("disc", 1.0, (0, 0, 0), (1e-3, 1e-3, 1e-3))
    hinge = spinning.joint("revolute", mb.WORLD, disc, (0, 0, 0))
    spinning.motor(hinge, "drive", position_gain=50.0, velocity_gain=2.0, damping_on="joint")
    spinning.target(disc, (1.0, 0, 0))
    times = np.arange(1001) * 1e-3
    run = mb.simulate(spinning.compile(), 0.5 * times[:, None], np.full((1001, 1), 0.5), 1e-3)
    x, y, _ = run.positions[-1, 0]
    assert 0.5 - np.arctan2(y, x) == pytest.approx(0.5 * 2.0 / 50.0, rel=1e-6)


@pytest.mark.parametrize(
    ("given", "meant"), [({"damping_on": "joints"}, "Did you mean joint"), ({"model": "drives"}, "Did you mean drive")]
)
def test_motors_of_names_that_do_not_exist_are_refused(given, meant):
    with pytest.raises(ValueError, match=meant):
        pendulum(**given)


def test_a_motor_turns_the_target_about_its_axis_and_holds_its_weight():
    angle = np.full((3, 1), np.pi / 2)
    run = mb.simulate(pendulum(model="prescribed"), angle, np.zeros((3, 1)), STEP)
    assert run.positions[-1, 0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    level = mb.simulate(pendulum(model="prescribed"), np.zeros((3, 1)), np.zeros((3, 1)), STEP)
    assert level.efforts[-1, 0] == pytest.approx(9.81 * 0.5, rel=1e-9)
    assert level.times == pytest.approx([0.0, STEP, 2 * STEP])


def test_positions_and_axes_are_those_of_the_world():
    slide = mb.Mechanism(gravity=(0, 0, 0))
    post = slide.body("post", 1.0, (0, 0, 0), (1e-3, 1e-3, 1e-3), position=(1, 2, 3))
    cart = slide.body("cart", 1.0, (0, 0, 0), (1e-3, 1e-3, 1e-3), position=(1, 2, 4))
    slide.joint("fixed", mb.WORLD, post, position=(1, 2, 3))
    slide.motor(slide.joint("prismatic", post, cart, position=(1, 2, 4), axis=(1, 1, 0)))
    slide.target(cart, position=(1, 2, 5))
    run = mb.simulate(slide.compile(), np.full((3, 1), np.sqrt(2.0)), np.zeros((3, 1)), STEP)
    assert run.positions[-1, 0] == pytest.approx([2.0, 3.0, 5.0], abs=1e-9)


def test_a_body_that_no_joint_leads_to_is_refused():
    alone = mb.Mechanism()
    alone.body("alone", 1.0, (0, 0, 0), (1e-3, 1e-3, 1e-3))
    with pytest.raises(ShotError, match="/alone: no chain of joints"):
        alone.compile()


def test_a_reduced_body_with_missing_markers_is_refused():
    from arms import chain

    character = chain(1)
    tree = span_tree(character)
    reduced = rigid_body(character.bodies[0], body_anchors(character, tree)[0])
    arm = mb.Mechanism()
    link = arm.flexible_body("link", reduced)
    arm.joint("revolute", mb.WORLD, link, (0, 0, 0))
    with pytest.raises(ValueError, match="/link has 2 markers, and 1 joints"):
        arm.compile()


def test_only_bdf2_has_derivatives():
    run = mb.simulate(pendulum(model="prescribed"), np.zeros((3, 1)), np.zeros((3, 1)), STEP, integrator="rk4")
    with pytest.raises(ValueError, match="only BDF2"):
        mb.linearize(run)


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="no attribute 'simulation'"):
        mb.simulation  # noqa: B018
    assert set(mb.__all__) <= set(dir(mb))
