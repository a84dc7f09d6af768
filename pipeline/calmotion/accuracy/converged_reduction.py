"""Reduced bodies fine enough for a simulation: the tolerance of the reduction falls until the motion no longer changes.

What a reduction leaves out is estimated for each body by itself, at rest. In a robot that shakes it also shifts
frequencies, and a small shift makes the motions part in time; only the simulation itself tells by how much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from calmotion.accuracy.pod_subspace import ReferenceRun, reference_run
from calmotion.accuracy.simulate_to_tolerance import OF_SHAKE, intended_positions
from calmotion.accuracy.step_error import distance
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.shot import Animation, Character, FEMeshes
from calmotion.shot.character import with_settings
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.inputs.time_grid import MAX_STEP
from calmotion.simulation.prepare import Options, load_envelopes

if TYPE_CHECKING:
    from calmotion.reduction.reduce import FullBody

SHARE = 0.4  # of the tolerance, that what is left out may take
PAIRS = 0.1  # of the tolerance: a reduction finer than this sees pairs of coordinates as for this
FINER, MOST = 0.1, 6  # each tolerance of the reduction over the last, and how many there are


@dataclass(frozen=True, eq=False)
class ConvergedReduction:
    """Reduced bodies that do for a shot.

    Attributes:
        bodies: One for each body of the character.
        error_m: How far a target is from where the last coarser reduction had it [m]. That one would often do, but
            where two reductions agree by chance the finer is the safer.
        known: The shot as animated, simulated with these bodies.
    """

    bodies: tuple[ReducedBody, ...]
    error_m: float
    known: ReferenceRun


def converged_reduction(
    character: Character, animation: Animation, meshes: FEMeshes | None, options: Options,
    progress: Callable[[float, str], None] = lambda fraction, message: None, *, retargeted: bool = False,
) -> ConvergedReduction:  # fmt: skip
    """Bodies whose reduction moves no target by more than the tolerance, in the shot as it is animated.

    Args:
        options: With a tolerance.
        retargeted: The shot's shake will be taken away: a twentieth of it may change as well, as what is left of it
            afterwards is known far better.

    Raises:
        ShotError: A body cannot be reduced, or the shot not be simulated.
    """
    asked = options.tolerance
    assert asked is not None
    loads = load_envelopes(character, animation, meshes, options)
    tree = span_tree(character)
    full: dict[int, FullBody] = {}

    def reduced(tolerance: float) -> list[ReducedBody]:
        # what quadratic strain does not see has a bound of its own, and seeing all of it costs most of the time
        share = max(1.0, PAIRS * asked / tolerance)
        seeing = with_settings(character, lambda own: replace(own, pairs_share=share * own.pairs_share))
        return reduce_bodies(seeing, tree, meshes, None, loads, tolerance, full)

    def simulated(bodies: Sequence[ReducedBody], options: Options) -> ReferenceRun:
        return reference_run(character, animation, bodies, options, options.step or MAX_STEP)

    tolerance, bodies, off = asked, reduced(asked), 0.0
    found, allowed = simulated(bodies, options), SHARE * asked
    if retargeted:
        intended = intended_positions(character, animation, bodies, options)
        allowed = max(allowed, OF_SHAKE * distance(found.run.positions, intended))
    for k in range(MOST):
        progress((k + 1) / (MOST + 1), f"a reduction to {1e3 * tolerance:.2g} mm")
        tolerance *= FINER
        finer = reduced(tolerance)
        if _same(bodies, finer):
            continue
        then = simulated(finer, options)
        if then.run.integrator != found.run.integrator:  # it gave way for one of them, which differs by more
            options = replace(options, integrator=options.scheme)
            found, then = simulated(bodies, options), simulated(finer, options)
        off = distance(then.run.positions, found.run.positions)
        bodies, found = finer, then
        if off <= allowed:
            break
    return ConvergedReduction(tuple(bodies), off, found)


def _same(one: Sequence[ReducedBody], other: Sequence[ReducedBody]) -> bool:
    """Whether two reductions are of the same coordinates and laws."""
    return all(
        np.array_equal(a.stiffness, b.stiffness)
        and (a.elasticity is None) == (b.elasticity is None)
        and (a.elasticity is None or b.elasticity is None or a.elasticity.law == b.elasticity.law)
        for a, b in zip(one, other, strict=True)
    )
