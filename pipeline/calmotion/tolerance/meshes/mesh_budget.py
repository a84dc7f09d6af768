"""Meshes fine enough for a shot: refined until the errors of all meshes keep their share of the tolerance.

A coarse mesh makes a body too stiff. What that costs at the targets is the difference to a simulation with bodies that
are softer by the estimated error of their stiffness. Where the shake will be removed, only the deflection is left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from calmotion.errors import ShotError
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.reduction.scaled_stiffness import with_interface_stiffness, with_scaled_stiffness, with_scaled_strain
from calmotion.simulation.body_reduction import BodyReduction
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.tolerance.step_error import StepRun, distance, simulate_at

SHARE = 0.25  # of the tolerance, that the meshes may take
# Nodes of a mesh that only linear modes are computed on: some seconds; and of one without which the tolerance is not
# kept, some two minutes on two slow cores
NODES, MOST_NODES = 20_000, 100_000
_MARGIN = 0.8  # of the wanted error: estimates of two meshes differ
_LOCKED = 2.0  # error of what quadratic strain changes, over that of the compliance of the elements
_PARTS = (1.0, 0.25, 0.05)  # of an error that are tried until a shot can be simulated with it
_SOFTEST = 0.5  # factor of a stiffness or a strain; a mesh that is off by more is of no use


def meshes_to_tolerance(
    shot: CompiledShot, reduction: BodyReduction, options: RunSettings,
    run: StepRun | None, progress: Callable[[float, str], None] = lambda fraction, message: None,
) -> tuple[CompiledShot, BodyReduction]:  # fmt: skip
    """The shot and its reduction on meshes that keep their share of the tolerance, as far as the limit of nodes allows.

    Args:
        shot: With the bodies of a first reduction.
        reduction: Which made them.
        options: With the tolerance.
        run: The shot as animated; None where its shake will be removed, and with it the effect of the stiffness on its
            frequencies.

    Raises:
        ShotError: A body cannot be reduced, or the shot not be simulated.
    """
    known = {b: body.mesh_error_m or 0.0 for b, body in enumerate(shot.bodies) if body.mesh_error_m}
    bound = sum(known.values())
    if not bound:
        return shot, reduction
    total = bound if run is None else stiffness_error(shot, options, run) or bound
    locked = 0.0 if run is None else locking_error(shot, options, run)
    allowed = SHARE * tolerance_of(shot.character, options.tolerance)
    if total + locked <= allowed:
        return shot, reduction
    costs = {b: total / bound * error for b, error in known.items()}
    wanted, elements, left = {}, {}, max(allowed - locked, 0.5 * allowed)
    for b, share in _shares(costs, _MARGIN * left).items():
        if share < costs[b]:
            wanted[b] = (shot.bodies[b].mesh_error or 0.0) * share / costs[b]
    if locked > 0.5 * allowed:
        elements = {b: 0.5 * _MARGIN * allowed / locked * shot.bodies[b].element_error for b in known}
        wanted = {b: shot.bodies[b].mesh_error or 0.0 for b in known} | wanted
    finer = reduction.with_finer_meshes(
        options.tolerance, wanted, NODES, progress, elements=elements, poor_nodes=MOST_NODES
    )
    reduction.release()
    return shot.with_bodies(finer.bodies(options.tolerance, progress=progress)), finer


def mesh_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float | None:
    """Estimated error of the meshes at the targets [m]; None where nothing is flexible, or one mesh is not known.

    Args:
        shot: With the curves of the run.
        run: A run of it.
    """
    found = stiffness_error(shot, options, run)
    return None if found is None else found + locking_error(shot, options, run)


def stiffness_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float | None:
    """The part of it of the stiffness: elements are too stiff, in each direction by its own share."""
    flexible = [body for body in shot.bodies if len(body.stiffness)]
    if not flexible or any(body.mesh_error is None for body in flexible):
        return None
    off = _if_other(shot, options, run, _softest)
    return sum(body.mesh_error_m or 0.0 for body in flexible) if off is None else off


def locking_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float:
    """The part of it of the quadratic strain, which finer meshes tell nothing about by their linear modes [m].

    Quadratic elements cannot follow the stretching that bending far causes, and make up for it by more stiffness
    (membrane locking). Measured on slender arms against regular meshes with three elements across, both with reductions
    that are converged: what quadratic strain changes is off by 0.1 to 1.6 times the error of the compliance of the
    elements, by the most on meshes that were bisected.
    """

    def unlocked(body: ReducedBody, share: float) -> ReducedBody:
        return with_scaled_strain(body, _left(share * _LOCKED * body.element_error))

    if all(unlocked(body, 1.0) is body for body in shot.bodies):
        return 0.0
    off = _if_other(shot, options, run, unlocked)
    return sum(_LOCKED * body.element_error * _bent(body) for body in shot.bodies) if off is None else off


def patch_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float:
    """Estimated error of the interface patches at the targets by their rims [m]; arguments as of `mesh_error`.

    The error of the meshes does not contain it: finer meshes have the same rims.
    """
    if not any(body.patch_error for body in shot.bodies if len(body.stiffness)):
        return 0.0
    off = _if_other(shot, options, run, lambda body, share: _softened(body, share * body.patch_error))
    return sum(body.patch_error * _bent(body) for body in shot.bodies) if off is None else off


def _bent(body: ReducedBody) -> float:
    """How far a body bends under its loads [m], as far as that is known."""
    return body.mesh_error_m / body.mesh_error if body.mesh_error_m and body.mesh_error else 0.0


def _softest(body: ReducedBody, share: float) -> ReducedBody:
    """A body as soft as it may be on ever finer meshes, or a share of the way there."""
    known = body.interfaces
    if known is None:
        return _softened(body, share * (body.mesh_error or 0.0))
    return with_interface_stiffness(body, known.patches, known.own, known.own + share * (known.softest - known.own))


def _softened(body: ReducedBody, error: float) -> ReducedBody:
    return with_scaled_stiffness(body, _left(error))


def _left(error: float) -> float:
    """What a relative error leaves of a stiffness or a strain."""
    return max(1.0 - error, _SOFTEST)


def _if_other(
    shot: CompiledShot, options: RunSettings, run: StepRun, other: Callable[[ReducedBody, float], ReducedBody]
) -> float | None:
    """How far targets move with other bodies [m]; None where even slightly other ones buckle.

    Where a body buckles that is off by its whole error, a smaller part of it is tried, and counts the more often.

    Args:
        other: A body off by a share of its error.
    """
    options = replace(options, integrator=run.integrator or options.integrator)
    for share in _PARTS:
        others = shot.with_bodies([other(body, share) for body in shot.bodies])
        try:
            return distance(run.positions, simulate_at(others, options, run.step).positions) / share
        except ShotError:
            continue
    return None


def _shares(costs: dict[int, float], allowed: float) -> dict[int, float]:
    """What each of the errors may be, so that their sum is allowed: none is larger than it is or than the others."""
    ascending = sorted(costs, key=lambda b: costs[b])
    shares, left = {}, allowed
    for done, b in enumerate(ascending):
        shares[b] = min(costs[b], left / (len(ascending) - done))
        left -= shares[b]
    return shares
