"""Meshes of references: with several times the nodes of those that are measured."""

from __future__ import annotations

from calmotion.reduction.elements.assembly import quadratic_mesh
from calmotion.simulation.body_reduction import BodyReduction

TIMES = 8.0  # nodes of a reference over those of what is measured
_LAST = 0.6  # refinement ends above this part of its limit of nodes
# Most nodes of the meshes that the stiffness of those is taken from (results take theirs from up to a third of them),
# and its relative error from which on these are fine enough
STIFFNESS_NODES, _KNOWN = 300_000, 3e-5


def with_more_nodes(
    reduction: BodyReduction, times: float = TIMES, tolerance: float | None = None, stiffness: int = STIFFNESS_NODES
) -> BodyReduction:  # fmt: skip
    """The reduction on meshes with so many times the nodes, refined for the loads of the shot; the same for 1 or less.

    Their stiffness is that of meshes finer still, or it would be known less well than that of a result.

    Args:
        reduction: With meshes and loads.
        times: Nodes of the largest mesh over those that it has; smaller meshes get at least as many more.
        tolerance: As of `BodyReduction.bodies` [m].
        stiffness: Largest number of nodes of the meshes that the stiffness is taken from.

    Raises:
        ShotError: A body that cannot be reduced.
    """
    if times <= 1.0 or reduction.meshes is None:
        return reduction
    meshes = reduction.meshes.meshes
    most = max(len(quadratic_mesh(mesh.points, mesh.tets).nodes) for mesh in meshes)
    wanted = {mesh.body: 0.0 for mesh in meshes}
    finer = reduction.with_finer_meshes(tolerance, wanted, int(times * most / _LAST), by_factor=False)
    return finer.with_finer_meshes(tolerance, dict.fromkeys(wanted, _KNOWN), stiffness)
