"""Refinement of a finite-element mesh where its error arises, until the error is as small as wanted.

Strains are singular at the edge of a clamp and concentrate at joints, so most of the error is in few elements. Smaller
elements everywhere reduce the error of a clamped beam in proportion to the element size; smaller elements where the
error is estimated to arise reduce it several times faster for the same number of nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.linear_algebra.multifrontal import FactorsTooLarge
from calmotion.mesh.bisection import bisected
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.quadratic import quadratic_nodes
from calmotion.mesh.tetrahedra import min_dihedral_deg
from calmotion.model.character import Body, Frame
from calmotion.model.meshes import FEMesh, MeshQuality
from calmotion.reduction.cache import cached_reduction
from calmotion.reduction.full_order.mesh_estimates import frequency_estimate, load_estimate
from calmotion.reduction.full_order.mesh_extrapolation import (
    Estimate,
    by_shape,
    deviation,
    extrapolation,
    interface_factors,
    mode_ratios,
)
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.reduce import FullBody, full_body, linear_modes

MARKED = 0.8  # share of the error in the elements that are bisected: halves the error with 1.7 times the nodes
_FEWER = 0.6  # the same where that would be too many nodes
_ROUNDS = 12
_KEPT = 0.005  # of their own error, what elements leave with the statics of finer ones: they have their own mass
# Relative difference of the stiffness of modes from one factor, and the same of the error that is left: from more on,
# finer elements are kept
_APART, _APART_OF_ERROR = 0.01, 0.3
# Nodes of the finest mesh after a first one that is itself near the limit: of its own, for two bisections, and at most
_FOLLOWED, _MOST = 3.3, 50_000
_POOR = 4.0  # of the wanted error: what meshes for loads must leave at least for more nodes
_PAYS = 0.85  # of the error before: less must be left by a mesh that is made because of a bad one
_FEW = 6_000  # nodes of elements on which a nonlinear body is reduced within a minute


@dataclass(frozen=True)
class Effort:
    """How far meshes are refined.

    Attributes:
        wanted: Relative error of the compliance that may be, with that of the volume.
        max_nodes: No mesh has many more nodes.
        poor: An error for which more nodes are spent; infinite: none.
        poor_nodes: Largest number of nodes of a mesh with a larger error.
        kept_nodes: Largest number of nodes of the mesh that takes the stiffness of finer ones, if by one factor.
        bad: An error, that of the volume included, for which still more nodes are spent.
        bad_nodes: Largest number of nodes of a mesh that follows one with a larger error.
        shape: An error by what a mesh leaves out of its surface, with which it stays as it is: no finer one repairs it.
    """

    wanted: float
    max_nodes: int
    poor: float = np.inf
    poor_nodes: int = 0
    kept_nodes: float = np.inf
    bad: float = np.inf
    bad_nodes: int = 0
    shape: float = np.inf

    def ends(self, error: float, nodes: int) -> bool:
        """Whether a mesh with an error is enough."""
        enough = self.bad if self.is_spent_on(nodes) else min(self.poor, self.bad)
        return error <= self.wanted or (not self._few(nodes) and error <= enough)

    def allows(self, error: float, nodes: int, finer: int) -> bool:
        """Whether a mesh with an error may be followed by one with so many nodes."""
        spent = error > self.bad or self.is_spent_on(nodes)  # what was begun because of a bad error goes on
        return self._few(nodes) or finer <= (self.bad_nodes if spent else self.poor_nodes)

    def is_spent_on(self, nodes: int) -> bool:
        """Whether a mesh has more nodes than a poor error alone is worth."""
        return nodes > self.poor_nodes > 0

    def _few(self, nodes: int) -> bool:
        return nodes <= 0.6 * self.max_nodes  # the next bisection may exceed the limit by its factor


def refined(mesh: FEMesh, estimate: Callable[[FEMesh], Estimate], effort: Effort, one_factor: bool = False) -> FEMesh:
    """The mesh, bisected until its estimated error is small enough; its quality holds the error.

    Args:
        mesh: To refine.
        estimate: Estimates the error of a mesh.
        effort: How far.
        one_factor: Whether a coarser mesh may take the stiffness of the finest one by one factor for all modes, that of
            the interfaces with it.
    """
    meshes, estimates = _bisected(mesh, estimate, effort, one_factor)
    excess, error = extrapolation(estimates, one_factor)
    if not one_factor:
        return _with_quality(mesh, meshes[-1], _quality(mesh, estimates[-1], estimates, 1.0 - excess, error))
    kept, factor, apart = _smallest(estimates, effort.kept_nodes, max(_APART, _APART_OF_ERROR * error))
    change, unsure = by_shape(estimates[0])
    quality = replace(
        mesh.quality, frequency_error=0.5 * (error + apart + _of_volume(mesh)), element_error=estimates[kept].error,
        stiffness_factor=factor * (1.0 - excess) * (1.0 + change), shape_error=0.5 * unsure,
    )  # fmt: skip
    return _with_quality(mesh, meshes[kept], quality)


def _smallest(estimates: Sequence[Estimate], nodes: float, enough: float) -> tuple[int, float, float]:
    """The mesh that takes the stiffness of the last of ever finer ones by a factor; that, and what modes deviate.

    Args:
        estimates: Of the meshes.
        nodes: At most so many, if modes deviate from one factor by no more than the next.
        enough: Relative deviation of the stiffness.
    """
    few = max([0, *(k for k, one in enumerate(estimates) if one.nodes <= nodes)])
    for k in range(few, len(estimates)):
        ratios, weights = mode_ratios(estimates[k], estimates[-1], complete=True)
        factor = float(weights @ ratios)
        apart = float(np.abs(ratios / factor - 1.0).max())
        if apart <= enough:
            break
    return k, factor, apart


def with_finer_stiffness(
    mesh: FEMesh, estimate: Callable[[FEMesh], Estimate], effort: Effort, elements: float = np.inf,
    known: FEMesh | None = None,
) -> FEMesh:  # fmt: skip
    """The mesh with the stiffness that ever finer ones have: the same elements, and factors for their stiffness.

    A mesh that is too coarse makes a body too stiff, by one share in bending and by another in twist:
    `interface_factors` are for the static response to wrenches on the interfaces, and one factor for all else. Finer
    meshes are needed for these and a few linear modes only, where the reduction of a nonlinear body on them takes ten
    times as long. The remaining error is that of the extrapolation; of a body without moving interfaces, also the
    deviation of the modes from one factor.

    Args:
        mesh, estimate, effort: As of `refined`.
        elements: Relative error of the compliance that the elements may have by themselves; finer ones are taken for
            less, as far as they are few.
        known: The same mesh with what is known of its stiffness. Where no finer one within the limit of nodes tells how
            much too stiff it is, and less error is known, this is returned: meshes of detailed links begin near the
            limit, and their first frequencies were found on meshes beyond it.
    """
    meshes, estimates = _bisected(mesh, estimate, effort)
    excess, error = extrapolation(estimates)
    few = max(1, sum(one.nodes <= _FEW for one in estimates))
    kept = next((k for k, one in enumerate(estimates[:few]) if one.error <= elements), few - 1)
    own = estimates[kept]
    ratios, weights = mode_ratios(own, estimates[-1])
    factor = float(weights @ ratios) if weights.any() else 1.0  # a link that hardly bends has no modes
    if not len(estimates[-1].interfaces):
        error += deviation(ratios, weights)
    quality = _quality(mesh, own, estimates, factor * (1.0 - excess), error)
    if known is not None and excess == 0.0 and kept == 0 and _error(known.quality) < _error(quality):
        return known
    return _with_quality(mesh, meshes[kept], quality)


def _error(quality: MeshQuality) -> float:
    return np.inf if quality.frequency_error is None else quality.frequency_error


def _with_quality(first: FEMesh, mesh: FEMesh, quality: MeshQuality) -> FEMesh:
    """A mesh that was bisected from the first one, with its quality."""
    quality = replace(quality, min_dihedral_deg=min_dihedral_deg(mesh.points, mesh.tets))
    return replace(mesh, quality=quality, missing=first.missing)


def _quality(mesh: FEMesh, own: Estimate, estimates: Sequence[Estimate], factor: float, error: float) -> MeshQuality:
    """The quality of elements with the stiffness that ever finer ones have.

    Args:
        mesh: The first mesh.
        own: Estimate of the elements.
        estimates: Of all meshes.
        factor: Of their stiffness.
        error: Of the compliance by the modes alone, relative.
    """
    rest = _of_volume(mesh) + (_KEPT * own.error if own is not estimates[-1] else 0.0)
    first = estimates[0]
    factors, softest, directed = interface_factors(own, estimates, first.shape_stiffness) or (None, None, 0.0)
    if factors is not None and softest is not None:
        softest = softest - rest * factors
    return replace(
        mesh.quality, frequency_error=0.5 * (max(error, directed) + rest), element_error=own.error,
        stiffness_factor=factor * (1.0 + by_shape(first)[0]), interface_factors=factors, interface_softest=softest,
    )  # fmt: skip


def _bisected(
    mesh: FEMesh, estimate: Callable[[FEMesh], Estimate], effort: Effort, one_factor: bool = False
) -> tuple[list[FEMesh], list[Estimate]]:  # fmt: skip
    """Ever finer meshes from the given one on, until what an extrapolation leaves is small enough; their estimates."""
    meshes, estimates = [mesh], [estimate(mesh)]
    if by_shape(estimates[0])[1] > effort.shape:
        return meshes, estimates
    # elements do not repair the volume, and far below its error they gain nothing
    by_volume = _of_volume(mesh)
    effort = replace(
        effort, wanted=max(effort.wanted - by_volume, 0.5 * by_volume, 0.3 * effort.wanted),
        bad=max(effort.bad - by_volume, 0.5 * by_volume),
    )  # fmt: skip
    last = np.inf
    for _ in range(_ROUNDS):
        by_interfaces = interface_factors(estimates[-1], estimates)
        error = max(extrapolation(estimates, one_factor)[1], by_interfaces[2] if by_interfaces else 0.0)
        if effort.ends(error, estimates[-1].nodes):
            break
        if effort.is_spent_on(estimates[-1].nodes) and error > _PAYS * last:
            break  # as where parts hang on a hinge, which ever finer elements hold less and less
        last = error
        for marked in (MARKED, _FEWER):
            finer = bisected_where(meshes[-1], estimates[-1].indicators, marked)
            allowed = effort.allows(error, estimates[-1].nodes, quadratic_nodes(finer.points, finer.tets))
            if allowed or not effort.poor_nodes:
                break
        if not allowed:
            break
        try:
            estimates.append(estimate(finer))
        except FactorsTooLarge:
            break  # the error that is left is told
        meshes.append(finer)
    return meshes, estimates


def bisected_where(mesh: FEMesh, indicators: Array, share: float = MARKED) -> FEMesh:
    """The mesh with the elements bisected that together have a share of the error.

    Args:
        mesh: To refine.
        indicators: Part of each element in the error, shape [m].
        share: Of the error.
    """
    points, tets = bisected(mesh.points, mesh.tets, _largest(indicators, share))
    return replace(mesh, points=points, tets=tets, missing=None)  # the first mesh tells it


def _of_volume(mesh: FEMesh) -> float:
    """Relative error of the compliance by that of the volume: the stiffness of a rod goes with its section squared."""
    return 2.0 * abs(mesh.quality.volume_error)


def refined_for_loads(
    mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int, loads: LoadEnvelope,
    tolerance: float, wanted: float, max_nodes: int, by_factor: bool = True, full: FullBody | None = None,
    elements: float = np.inf, poor_nodes: int = 0,
) -> FEMesh:  # fmt: skip  # parameters: all that decide about a cached mesh
    """The mesh, refined where the deflections of the body under the loads of the shot have their error.

    Results are stored in the cache of reductions.

    Args:
        mesh, body, attachments, root: As of `reduce_body`.
        loads: Of the body.
        tolerance: Of the modes that count, as of `reduce_body` [m].
        wanted, max_nodes: As of `Effort`; by factor, more nodes where the first mesh has many.
        by_factor: `with_finer_stiffness` instead of finer elements.
        full: `full_body` of the mesh with its own stiffness, where it is known.
        elements: As of `with_finer_stiffness`.
        poor_nodes: By factor, largest number of nodes of a mesh that follows one which is off by several times what is
            wanted; 0: as of others.

    Raises:
        ShotError: As `reduce_body`.
    """
    first = with_own_stiffness(mesh)
    estimate = load_estimator(body, attachments, root, loads, tolerance, None if full is None else (first, full))
    given = replace(body, surfaces=())  # skins do not matter
    key = ("for loads", mesh, given, attachments, root, loads, tolerance, wanted, max_nodes, by_factor, elements,
           poor_nodes)  # fmt: skip
    if not by_factor:
        return cached_reduction(key, lambda: refined(first, estimate, Effort(wanted, max_nodes)))
    nodes = int(min(_FOLLOWED * quadratic_nodes(mesh.points, mesh.tets), _MOST))
    effort = Effort(wanted, max(max_nodes, nodes))
    if poor_nodes:
        by_volume = _of_volume(mesh)
        poor = max(_POOR * wanted - by_volume, by_volume)
        effort = replace(effort, poor=poor, poor_nodes=max(poor_nodes, effort.max_nodes))
    return cached_reduction(key, lambda: with_finer_stiffness(first, estimate, effort, elements, mesh))


def with_own_stiffness(mesh: FEMesh) -> FEMesh:
    """The mesh without what finer ones told about its stiffness."""
    return replace(mesh, quality=replace(mesh.quality, stiffness_factor=1.0, interface_factors=None))


def load_estimator(
    body: Body, attachments: Sequence[AttachmentFrame], root: int, loads: LoadEnvelope, tolerance: float,
    known: tuple[FEMesh, FullBody] | None = None,
) -> Callable[[FEMesh], Estimate]:  # fmt: skip
    """Estimates the errors of meshes under loads.

    Args:
        body, attachments, root, loads, tolerance: As of `refined_for_loads`.
        known: A mesh and its `full_body`.
    """

    def estimate(mesh: FEMesh) -> Estimate:
        full = known[1] if known is not None and mesh is known[0] else full_body(mesh, body, attachments, root)
        return load_estimate(linear_modes(mesh, body, attachments, root, loads, tolerance, full), body, mesh.missing)

    return estimate


def refined_for_frequencies(
    mesh: FEMesh, body: Body, carrier: Frame | None, effort: Effort, attachments: Sequence[AttachmentFrame] = ()
) -> FEMesh:
    """The mesh, refined where the first modes of the body, clamped at its parent joint, have their error.

    Args:
        mesh: Of the body.
        body: With `flexible` settings.
        carrier: Frame of the parent joint on the body; None for a free body.
        effort: How far; errors are those of the compliance, twice those of the frequencies.
        attachments: Frames of all its joints: what is nearer to another joint is not held by the parent's.
    """
    estimate = partial(frequency_estimate, body=body, carrier=carrier, attachments=attachments)
    key = ("for frequencies", mesh, replace(body, surfaces=()), carrier, effort, attachments)
    # the estimates of many links are still large with as many nodes; what the loads need is not known yet
    return cached_reduction(key, lambda: refined(mesh, estimate, effort, one_factor=True))


def _largest(indicators: Array, share: float) -> IntArray:
    """The fewest elements that together have a share of the error."""
    order = np.argsort(-indicators, kind="stable")
    summed = np.cumsum(indicators[order])
    return np.asarray(order[: 1 + int(np.searchsorted(summed, share * summed[-1]))])
