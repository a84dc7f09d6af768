"""The exact gradient on a whole sample, and its joints (identity 6 of the formulation)."""

import numpy as np
import pytest
from calmotion.host import open_host
from calmotion.model.run import RunSettings, Source
from calmotion.retargeting.problem.offset_basis import make_basis
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.intended_motion import rigid_motion
from calmotion.simulation.preparation import prepare
from calmotion.simulation.target_errors import Objective


@pytest.fixture(scope="module")
def problem(repository):
    shot = repository / "samples" / "bartender" / "bartender.usda"
    run = open_host([]).run([Source(path=str(shot), command="optimize")], [CompiledShot])
    assert not run.finish().failures()
    prepared = prepare(run.get(CompiledShot), RunSettings(step=1 / 120))
    character = prepared.character
    curves = sample_curves(prepared.shot.animation.tracks, prepared.grid)
    rigid = rigid_motion(prepared.model, curves.angles, curves.rates, prepared.grid.h)
    objective = Objective.over(prepared.model, rigid, prepared.grid)
    basis = make_basis(prepared.grid, 0.2, False)
    motors = np.arange(len(character.motors), dtype=np.int32)
    space = OffsetSpace.uncoupled(basis, motors, len(motors), 1e-8, 1e-4)
    return RetargetProblem.of_model(prepared.model, prepared.grid, curves, objective, space)


def test_gradient_matches_central_differences_of_the_whole_simulation(problem):
    rng = np.random.default_rng(0)
    x, d = 0.01 * rng.normal(size=problem.size), rng.normal(size=problem.size)
    at = problem.at(x)
    assert at.run.trajectory.max_joint_gap < 1e-6
    found = float(at.linearized().gradient @ d)

    def difference(e):
        return (problem.at(x + e * d).merit - problem.at(x - e * d).merit) / (2 * e)

    expected = (4.0 * difference(1e-4) - difference(2e-4)) / 3.0
    assert abs(found - expected) < 1e-7 * abs(expected)
