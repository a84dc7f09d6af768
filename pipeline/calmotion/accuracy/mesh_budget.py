"""Meshes fine enough for a shot: refined until the errors of all meshes keep their share of the tolerance.

A coarse mesh makes a body too stiff. What that costs at the targets is the difference to a simulation with bodies that
are softer by the estimated error of their stiffness. Where the shake will be removed, only the deflection is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from calmotion.accuracy.step_error import StepRun, distance, simulate_at
from calmotion.errors import ShotError
from calmotion.reduction.scaled_stiffness import with_scaled_stiffness
from calmotion.shot.run import RunSettings
from calmotion.shot.tolerance import tolerance_of
from calmotion.simulation.body_reduction import BodyReduction
from calmotion.simulation.compiled_shot import CompiledShot

SHARE = 0.25  # of the tolerance, that the meshes may take
NODES = 20_000  # of a mesh that only linear modes are computed on: some seconds
_MARGIN = 0.8  # of the wanted error: estimates of two meshes differ
_SOFTEST = 0.5  # factor of a stiffness; a mesh that is off by more is of no use


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
    total = bound if run is None else mesh_error(shot, options, run) or bound
    allowed = SHARE * tolerance_of(shot.character, options.tolerance)
    if total <= allowed:
        return shot, reduction
    costs = {b: total / bound * error for b, error in known.items()}
    wanted = {}
    for b, share in _shares(costs, _MARGIN * allowed).items():
        if share < costs[b]:
            wanted[b] = (shot.bodies[b].mesh_error or 0.0) * share / costs[b]
    finer = reduction.with_finer_meshes(options.tolerance, wanted, NODES, progress)
    reduction.release()
    return shot.with_bodies(finer.bodies(options.tolerance, progress=progress)), finer


def mesh_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float | None:
    """Estimated error of the meshes at the targets [m]; None where nothing is flexible, or one mesh is not known.

    Args:
        shot: With the curves of the run.
        run: A run of it.
    """
    flexible = [body for body in shot.bodies if len(body.stiffness)]
    if not flexible or any(body.mesh_error is None for body in flexible):
        return None
    off = _if_softer(shot, options, run, [body.mesh_error or 0.0 for body in shot.bodies])
    return sum(body.mesh_error_m or 0.0 for body in flexible) if off is None else off


def patch_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float:
    """Estimated error of the interface patches at the targets by their rims [m]; arguments as of `mesh_error`.

    The error of the meshes does not contain it: finer meshes have the same rims.
    """
    errors = [body.patch_error if len(body.stiffness) else 0.0 for body in shot.bodies]
    if not any(errors):
        return 0.0
    off = _if_softer(shot, options, run, errors)
    bent = [
        body.mesh_error_m / body.mesh_error if body.mesh_error_m and body.mesh_error else 0.0 for body in shot.bodies
    ]
    return sum(error * by for error, by in zip(errors, bent, strict=True)) if off is None else off


def _if_softer(shot: CompiledShot, options: RunSettings, run: StepRun, errors: Sequence[float]) -> float | None:
    """How far targets move where bodies are softer by relative errors [m]; None where they buckle then."""
    softer = [
        with_scaled_stiffness(body, max(1.0 - error, _SOFTEST)) for body, error in zip(shot.bodies, errors, strict=True)
    ]
    options = replace(options, integrator=run.integrator or options.integrator)
    try:
        other = simulate_at(shot.with_bodies(softer), options, run.step)
    except ShotError:
        return None
    return distance(run.positions, other.positions)


def _shares(costs: dict[int, float], allowed: float) -> dict[int, float]:
    """What each of the errors may be, so that their sum is allowed: none is larger than it is or than the others."""
    ascending = sorted(costs, key=lambda b: costs[b])
    shares, left = {}, allowed
    for done, b in enumerate(ascending):
        shares[b] = min(costs[b], left / (len(ascending) - done))
        left -= shares[b]
    return shares
