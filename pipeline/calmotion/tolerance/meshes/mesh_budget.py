"""What the meshes of a shot cost at the targets, and meshes refined until that keeps their share of the tolerance.

A coarse mesh makes a body too stiff. What that costs is the difference to a simulation with bodies that are softer by
the estimated error of their stiffness. Where the shake will be removed, only the deflection is left.
"""

from collections.abc import Callable
from dataclasses import replace

from calmotion.errors import ShotError
from calmotion.model.character import Character
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.reduction.scaled_stiffness import with_scaled_stiffness, with_scaled_strain
from calmotion.simulation.body_reduction import BodyReduction
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.tolerance.step_error import StepRun, distance, simulate_at

SHARE = 0.25  # of the tolerance, that the meshes may take
MOST_NODES = 100_000  # of a mesh without which the tolerance is not kept, some two minutes on two slow cores
UNASKED_NODES = 30_000  # where nobody asked for a tolerance: two links took 2.3 GB, with 45,000 nodes 3.2 GB
_GROWS = 1.4  # least factor of the nodes of a finer mesh that tells something, as of `MeshController`
OF_UNCERTAINTY = 0.2  # of what is not known of a modulus: meshes and reductions are no finer where nobody asked for it
_WORTH = 2.0  # of that: meshes with more are refined once more
_MARGIN = 0.8  # of the wanted error: estimates of two meshes differ
# Error of what quadratic strain changes, over that of the compliance of the elements: quadratic elements cannot follow
# the stretching that bending far causes (membrane locking). 0.1 to 1.6 on slender arms, against three elements across
_LOCKED = 2.0
_PARTS = (1.0, 0.25, 0.05)  # of an error that are tried until a shot can be simulated with it
_SOFTEST = 0.5  # factor of a stiffness or a strain; a mesh that is off by more is of no use


def meshes_to_tolerance(
    shot: CompiledShot, reduction: BodyReduction, options: RunSettings,
    run: StepRun, progress: Callable[[float, str], None] = lambda fraction, message: None,
    bodies: Callable[[BodyReduction], list[ReducedBody]] | None = None, *, retargeted: bool = False,
) -> tuple[CompiledShot, BodyReduction]:  # fmt: skip
    """The shot and its reduction on meshes that keep their share of the tolerance, as far as the limit of nodes allows.

    Args:
        shot: With reduced bodies.
        reduction: Which made them.
        options: With the tolerance.
        run: The shot as animated.
        progress: Called with a fraction and the body at hand.
        bodies: Makes the bodies on the finer meshes; None: to the tolerance.
        retargeted: The shot's shake will be removed, and with it the effect of the stiffness on its frequencies: the
            meshes cost no more than their part of the deflection.

    Raises:
        ShotError: A body cannot be reduced, or the shot not be simulated.
    """
    known = {b: body.mesh_error_m or 0.0 for b, body in enumerate(shot.bodies) if body.mesh_error_m}
    bound = sum(known.values())
    if not bound:
        return shot, reduction
    allowed = SHARE * tolerance_of(shot.character, options.tolerance)
    if retargeted and bound <= allowed:
        return shot, reduction
    total = mesh_error(shot, options, run) or bound
    if retargeted:
        total = min(total, bound)  # the bound is of all loads at their worst, which the motion mostly is not
    if total <= allowed:
        return shot, reduction
    costs = {b: total / bound * error for b, error in known.items()}
    wanted = {}
    assert reduction.meshes is not None
    by_volume = {mesh.body: mesh.quality.error_of_solid for mesh in reduction.meshes.meshes}
    unknown = {b: unknown_stiffness(shot.character, b, options.tolerance) for b in known}
    most = UNASKED_NODES if any(unknown.values()) else MOST_NODES
    for b, share in _shares(costs, _MARGIN * allowed).items():
        whole, least = shot.bodies[b].mesh_error or 0.0, unknown[b]
        own = whole - by_volume[b]  # bisected elements have the volume that they had
        goal = max(whole * share / costs[b], OF_UNCERTAINTY * least)
        if goal < own and own > _WORTH * OF_UNCERTAINTY * least and _GROWS * shot.bodies[b].nodes <= most:
            wanted[b] = goal
    if not wanted:
        return shot, reduction
    finer = reduction.with_finer_meshes(options.tolerance, wanted, most, progress)
    reduction.release()
    made = finer.bodies(options.tolerance, progress=progress) if bodies is None else bodies(finer)
    return shot.with_bodies(made), finer


def mesh_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float | None:
    """Estimated error of the meshes at the targets [m]; None where nothing is flexible, or one mesh is not known.

    Where a body buckles that is as soft as it may be, a smaller part of its error is tried, and counts the more often.

    Args:
        shot: With the curves of the run.
        run: A run of it.
    """
    flexible = [body for body in shot.bodies if len(body.stiffness)]
    if not flexible or any(body.mesh_error is None for body in flexible):
        return None
    options = replace(options, integrator=run.integrator or options.integrator)
    for share in _PARTS:
        softer = shot.with_bodies([_softer(body, share) for body in shot.bodies])
        try:
            return distance(run.positions, simulate_at(softer, options, run.step).positions) / share
        except ShotError:
            continue
    return sum(body.mesh_error_m or 0.0 for body in flexible)


def unknown_stiffness(character: Character, index: int, requested: float | None) -> float:
    """What is not known of the stiffness of a body, relative; 0 where a tolerance was asked for: then all counts.

    Args:
        character: The character.
        index: Of the body.
        requested: The user's tolerance [m], or None.
    """
    flexible = character.bodies[index].flexible
    if flexible is None or requested is not None or character.retarget.tolerance is not None:
        return 0.0
    return character.retarget.uncertainty.of_modulus(flexible.material.path)


def finer_than_known(character: Character, index: int, error: float | None, requested: float | None) -> bool:
    """Whether a mesh is so fine that its error is small beside what is not known of the stiffness of a body.

    Args:
        character, index, requested: As of `unknown_stiffness`.
        error: Relative error of the stiffness by the mesh; None: not known.
    """
    return error is not None and error <= _WORTH * OF_UNCERTAINTY * unknown_stiffness(character, index, requested)


def uncertainty_error(shot: CompiledShot, options: RunSettings, run: StepRun) -> float:
    """How far targets move with bodies that are softer by what is not known of their stiffness [m]."""
    unknown = [unknown_stiffness(shot.character, b, options.tolerance) for b in range(len(shot.bodies))]
    if not any(share for share, body in zip(unknown, shot.bodies, strict=True) if len(body.stiffness)):
        return 0.0
    softer = [
        with_scaled_stiffness(body, 1.0 / (1.0 + share)) for body, share in zip(shot.bodies, unknown, strict=True)
    ]
    options = replace(options, integrator=run.integrator or options.integrator)
    try:
        return distance(run.positions, simulate_at(shot.with_bodies(softer), options, run.step).positions)
    except ShotError:
        return 0.0


def _softer(body: ReducedBody, share: float) -> ReducedBody:
    """A body as soft as it may be on ever finer meshes, or a share of the way there."""
    softer = with_scaled_stiffness(body, max(1.0 - share * (body.mesh_error or 0.0), _SOFTEST))
    return with_scaled_strain(softer, max(1.0 - share * _LOCKED * body.element_error, _SOFTEST))


def _shares(costs: dict[int, float], allowed: float) -> dict[int, float]:
    """What each of the errors may be, so that their sum is allowed: none is larger than it is or than the others."""
    ascending = sorted(costs, key=lambda b: costs[b])
    shares, left = {}, allowed
    for done, b in enumerate(ascending):
        shares[b] = min(costs[b], left / (len(ascending) - done))
        left -= shares[b]
    return shares
