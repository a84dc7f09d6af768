"""Derivatives of a residual or limit that a plugin adds to a search, against differences."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calmotion.model import Animation, Character
from calmotion.model.run import RunSettings
from calmotion.reduction import ReducedBody
from calmotion.retargeting.problem.posing import pose
from calmotion.retargeting.quantities.terms import SearchTerm
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import intended_motion

STEP = 1e-5  # of the differences, in offsets of about 0.01 rad
NAME = "the term"


def derivative_error(
    term: SearchTerm, character: Character, animation: Animation, bodies: Sequence[ReducedBody] | None = None
) -> float:
    """By how much the derivatives of a term's quantity differ from central differences, and their transpose from them,
    as a share of their size: about 1e-6 where they are right.

    Args:
        bodies: Reduced bodies of the flexible ones, which are rigid without.
    """
    prepared = prepare(compile_shot(character, animation, bodies), RunSettings(step=1 / 240))
    curves = sample_curves(animation.tracks, prepared.grid)
    intended = intended_motion(prepared, curves.angles, curves.rates)
    problem, _, _ = pose(prepared, curves, intended, RunSettings(knot_spacing=0.1))
    quantity = term.quantity(character, problem.model, prepared.grid)
    robot = replace(problem.robots[0], limited={NAME: quantity})
    problem, random = replace(problem, robots=(robot,)), np.random.default_rng(7)
    x, direction = (1e-2 * random.normal(size=problem.size) for _ in range(2))
    ends = [quantity.values(problem.at(x + side * STEP * direction).run) for side in (1.0, -1.0)]
    linear = problem.at(x).runs[0].linearized(0)
    change = linear.tangent(*problem.space.offsets(direction), [NAME])[1][NAME]
    size = max(float(np.linalg.norm(change)), 1e-300)
    found = np.linalg.norm(change - (ends[0] - ends[1]) / (2.0 * STEP)) / size
    pulls = random.normal(size=change.shape)
    pulled = linear.adjoint(np.zeros_like(linear.at.residuals), {NAME: pulls})
    both = sum(float(np.sum(one * other)) for one, other in zip(pulled, problem.space.offsets(direction), strict=True))
    return max(float(found), float(abs(both - np.sum(pulls * change)) / np.linalg.norm(pulls) / size))
