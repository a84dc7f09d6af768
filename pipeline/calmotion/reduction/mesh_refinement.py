"""Refinement of a finite-element mesh where its error arises, until the error is as small as wanted.

Strains are singular at the edge of a clamp and concentrate at joints, so most of the error is in few elements. Smaller
elements everywhere reduce the error of a clamped beam in proportion to the element size; smaller elements where the
error is estimated to arise reduce it several times faster for the same number of nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from calmotion.errors import ShotError
from calmotion.geometry.tetrahedra import min_dihedral_deg
from calmotion.reduction.cache import cached_reduction
from calmotion.reduction.discretization_error import clamped_modes, element_errors
from calmotion.reduction.elements.assembly import QuadraticMesh, assemble
from calmotion.reduction.elements.bisection import bisected
from calmotion.reduction.interfaces.interface_patches import AttachmentFrame, interface_patches
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.choice import amplitudes
from calmotion.reduction.reduce import FullBody, linear_modes
from calmotion.shot.character import Array, Body, Frame, IntArray
from calmotion.shot.meshes import CutPatch, FEMesh

MARKED = 0.8  # share of the error in the elements that are bisected: halves the error with 1.7 times the nodes
_GAIN = 1.2  # least ratio of estimates that are compared
# Error that is left by an extrapolation, measured on four beams and plates with patches, three modes each: of what was
# extrapolated, and of the difference of the extrapolations from two coarser meshes
_LEFT, _APART = 0.2, 1.5
_LEAST = 0.1  # of the estimate of the finer mesh: the least error that is claimed
_STIFFEST = 0.05  # excess of the stiffness of an interface in any direction that is extrapolated
_MODES, _COUNT = 12, 3  # modes of a load estimate; frequencies that a motion excites
_ASYMPTOTIC = 0.05  # largest estimate that is in proportion to the error
_ROUNDS = 12


@dataclass(frozen=True, eq=False)
class Estimate:
    """The estimated error of a mesh.

    Attributes:
        error: Of the compliance, relative.
        squares: Squares of the frequencies of its modes [1/s^2], ascending, shape [k].
        weights: Share of each mode in the deflection, in sum one, shape [k].
        indicators: Part of each element in the error, shape [m].
        nodes: Number of nodes of the quadratic tetrahedra.
        interfaces: Static stiffness of its p moving interfaces, shape [6p, 6p].
        wrenches: Largest loads on these, shape [6p].
    """

    error: float
    squares: Array
    weights: Array
    indicators: Array
    nodes: int
    interfaces: Array = field(default_factory=lambda: np.zeros((0, 0)))
    wrenches: Array = field(default_factory=lambda: np.zeros(0))


def refined(
    mesh: FEMesh, estimate: Callable[[FEMesh], Estimate], wanted: float, max_nodes: int, extrapolates: bool = True
) -> FEMesh:
    """The mesh, bisected until its estimated error is small enough; its quality holds the error.

    Args:
        mesh: To refine.
        estimate: Estimates the error of a mesh.
        wanted: Relative error of the compliance that may be, with that of the volume.
        max_nodes: No mesh has many more nodes.
        extrapolates: Whether the mesh takes the stiffness that ever finer ones would have, as far as it is known.
    """
    finest, estimates = _bisected(mesh, estimate, wanted, max_nodes)
    excess, error = extrapolation(estimates)
    factors = None
    if extrapolates:
        factors, error = _interface_factors(estimates[-1], estimates, error)
    else:
        excess, error = 0.0, min(excess + error, estimates[-1].error)
    error += _of_volume(mesh)
    quality = replace(
        mesh.quality, frequency_error=0.5 * error, stiffness_factor=1.0 - excess, interface_factors=factors
    )
    if finest is not mesh:
        quality = replace(quality, min_dihedral_deg=min_dihedral_deg(finest.points, finest.tets))
    return replace(finest, quality=quality)


def with_finer_stiffness(mesh: FEMesh, estimate: Callable[[FEMesh], Estimate], wanted: float, max_nodes: int) -> FEMesh:
    """The mesh with the stiffness that ever finer ones have: the same elements, and factors for their stiffness.

    A mesh that is too coarse makes a body too stiff, by one share in bending and by another in twist:
    `interface_factors` are for the static response to wrenches on the interfaces, and one factor for all else. Finer
    meshes are needed for these and a few linear modes only, where the reduction of a nonlinear body on them takes ten
    times as long. The remaining error is that of the extrapolation; of a body without moving interfaces, also the
    deviation of the modes from one factor.

    Args:
        mesh, estimate, wanted, max_nodes: As of `refined`.
    """
    _, estimates = _bisected(mesh, estimate, wanted, max_nodes)
    excess, error = extrapolation(estimates)
    ratios, weights = _ratios(estimates[0], estimates[-1])
    factor = float(weights @ ratios)
    factors, error = _interface_factors(estimates[0], estimates, error)
    error += (_deviation(ratios, weights) if factors is None else 0.0) + _of_volume(mesh)
    factor *= 1.0 - excess
    quality = replace(mesh.quality, frequency_error=0.5 * error, stiffness_factor=factor, interface_factors=factors)
    return replace(mesh, quality=quality)


def _bisected(
    mesh: FEMesh, estimate: Callable[[FEMesh], Estimate], wanted: float, max_nodes: int
) -> tuple[FEMesh, list[Estimate]]:
    """The refined mesh, and the estimates of all meshes from the given one on."""
    estimates = [estimate(mesh)]
    # elements do not repair the volume, and far below its error they gain nothing
    by_volume = _of_volume(mesh)
    wanted = max(wanted - by_volume, 0.5 * by_volume, 0.3 * wanted)
    for _ in range(_ROUNDS):
        # the last bisection may exceed the limit by its factor of about 1.7
        if extrapolation(estimates)[1] <= wanted or estimates[-1].nodes > 0.6 * max_nodes:
            break
        points, tets = bisected(mesh.points, mesh.tets, _largest(estimates[-1].indicators))
        mesh = replace(mesh, points=points, tets=tets)
        estimates.append(estimate(mesh))
    return mesh, estimates


def _of_volume(mesh: FEMesh) -> float:
    """Relative error of the compliance by that of the volume: the stiffness of a rod goes with its section squared."""
    return 2.0 * abs(mesh.quality.volume_error)


def refined_for_loads(
    mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int, loads: LoadEnvelope,
    tolerance: float, wanted: float, max_nodes: int, by_factor: bool = True, full: FullBody | None = None,
) -> FEMesh:  # fmt: skip
    """The mesh, refined where the deflections of the body under the loads of the shot have their error.

    Results are stored in the cache of reductions.

    Args:
        mesh, body, attachments, root: As of `reduce_body`.
        loads: Of the body.
        tolerance: Of the modes that count, as of `reduce_body` [m].
        wanted, max_nodes: As of `refined`.
        by_factor: `with_finer_stiffness` instead of finer elements.
        full: `full_body` of the mesh with its own stiffness, where it is known.

    Raises:
        ShotError: As `reduce_body`.
    """
    assert body.flexible is not None
    material = body.flexible.material
    first = replace(mesh, quality=replace(mesh.quality, stiffness_factor=1.0, interface_factors=None))

    def estimate(mesh: FEMesh) -> Estimate:
        linear = linear_modes(mesh, body, attachments, root, loads, tolerance, full if mesh is first else None)
        envelope = linear.load_envelope
        assert envelope is not None
        count = min(_MODES, len(linear.basis.omega_squared))
        squares = linear.basis.omega_squared[:count]
        energy = squares * amplitudes(linear.model, linear.basis, envelope, count) ** 2
        weights = energy / max(energy.sum(), np.finfo(float).tiny)
        parts = element_errors(linear.model.mesh, material, linear.basis.modes[:, :, :count]) @ weights
        stiffness = linear.support.fixed(linear.model).patch_stiffness()
        wrenches = np.hstack([envelope.force, envelope.moment]).ravel()
        nodes = len(linear.model.mesh.nodes)
        return Estimate(float(parts.sum()), squares, weights, parts, nodes, stiffness, wrenches)

    given = replace(body, surfaces=())  # skins do not matter
    key = ("for loads", first, given, attachments, root, loads, tolerance, wanted, max_nodes, by_factor)
    refine = with_finer_stiffness if by_factor else refined
    return cached_reduction(key, lambda: refine(first, estimate, wanted, max_nodes))


def refined_for_frequencies(mesh: FEMesh, body: Body, carrier: Frame | None, wanted: float, max_nodes: int) -> FEMesh:
    """The mesh, refined where the first modes of the body, clamped at its parent joint, have their error.

    Args:
        mesh: Of the body.
        body: With `flexible` settings.
        carrier: Frame of the parent joint on the body; None for a free body.
        wanted: Relative error of the first frequencies.
        max_nodes: As of `refined`.
    """
    estimate = partial(frequency_estimate, body=body, carrier=carrier)
    key = ("for frequencies", mesh, replace(body, surfaces=()), carrier, wanted, max_nodes)
    # the stiffness is that for the loads of the shot, which are not known yet
    return cached_reduction(key, lambda: refined(mesh, estimate, 2.0 * wanted, max_nodes, extrapolates=False))


def frequency_estimate(mesh: FEMesh, body: Body, carrier: Frame | None) -> Estimate:
    """Error of the first modes, of which each counts by its compliance relative to that of the first.

    Args:
        mesh, body, carrier: As of `refined_for_frequencies`.

    Raises:
        ShotError: Nothing of the mesh is free.
    """
    assert body.flexible is not None
    model = assemble(mesh.points, mesh.tets, body.flexible.material)
    frequencies, modes = clamped_modes(model, _COUNT, _clamped_nodes(model.mesh, body, carrier, mesh.patches))
    if not len(frequencies):
        raise ShotError(
            "its parent joint holds all of the mesh, so that nothing of it can bend", path=body.path,
            attribute="calm:flexible:interfaceRadius", found=f"{len(mesh.tets)} tetrahedra",
            remedy="Use a finer mesh or a smaller interface, or set calm:flexible:enabled to false.",
        )  # fmt: skip
    weights = (frequencies[0] / frequencies) ** 2
    errors = element_errors(model.mesh, body.flexible.material, modes)
    total = float((errors * weights).sum(axis=0).max())
    squares = (2.0 * np.pi * frequencies) ** 2
    return Estimate(total, squares, weights / weights.sum(), errors @ weights, len(model.mesh.nodes))


def extrapolation(estimates: Sequence[Estimate]) -> tuple[float, float]:
    """How much too stiff the last of ever finer meshes is, relative, and the error of the stiffness without that.

    Recovered strains overestimate the error, but in proportion: where refinement lowers the estimate by a factor, the
    error of the finer mesh is the change of the stiffness over this factor minus one. Two extrapolations, from coarser
    meshes with estimates below 5%, show how well that is known; one alone may be wrong by all of it. Estimates of
    coarser meshes are not in proportion to their errors.

    Source: Richardson's extrapolation, by the estimated error in place of the element size.
    """
    fine, excesses = estimates[-1], []
    for coarse, gain in _compared(estimates):
        ratios, weights = _ratios(coarse, fine)
        excesses.append(float(weights @ (1.0 - ratios)) / gain)
    if not excesses or min(excesses) <= 0.0:  # a finer mesh that is not softer tells nothing
        return 0.0, fine.error
    excess = min(excesses[0], fine.error)
    left = excess if len(excesses) == 1 else max(_LEFT * excess, _APART * abs(excesses[1] - excesses[0]))
    return excess, min(max(left, _LEAST * fine.error), fine.error)


def _compared(estimates: Sequence[Estimate]) -> list[tuple[Estimate, float]]:
    """The last two coarser meshes that tell about the last, and how much larger their estimates are, less one."""
    fine = estimates[-1]
    usable = [e for e in estimates[:-1] if _GAIN * fine.error <= e.error <= _ASYMPTOTIC]
    return [(e, e.error / max(fine.error, np.finfo(float).tiny) - 1.0) for e in usable[-2:]]


def _interface_factors(own: Estimate, estimates: Sequence[Estimate], error: float) -> tuple[Array | None, float]:
    """`MeshQuality.interface_factors` of a mesh by ever finer ones, extrapolated, and the error of the compliance.

    Args:
        own: Of the mesh.
        estimates: Of it and finer ones.
        error: Of the compliance by the modes alone.
    """
    from scipy.linalg import eigh

    fine, compared = estimates[-1], _compared(estimates)
    K = fine.interfaces
    if not len(K):
        return None, error
    if compared:
        first, *more = [(coarse.interfaces - K) / gain for coarse, gain in compared]
        excess, G = eigh(first, K)  # each of the motions G has an energy of one half
        excess = np.clip(excess, 0.0, max(fine.error, _STIFFEST))
        apart = [np.abs(np.einsum("ik,ij,jk->k", G, other - first, G)) for other in more]
        left = np.maximum(_LEFT * excess, _APART * apart[0]) if apart else excess
        shares = (np.abs(G).T @ fine.wrenches) ** 2
        error = max(error, float(left @ shares) / max(float(shares.sum()), np.finfo(float).tiny))
        wrenches = K @ G
        K = K - (wrenches * excess) @ wrenches.T
    return np.asarray(np.linalg.solve(own.interfaces, K)), error


def _ratios(coarse: Estimate, fine: Estimate) -> tuple[Array, Array]:
    """Stiffness of the modes of the finer mesh over that of the coarse one, and the weights of the modes."""
    count = min(len(coarse.squares), len(fine.squares))
    weights = fine.weights[:count]
    return fine.squares[:count] / coarse.squares[:count], weights / max(weights.sum(), np.finfo(float).tiny)


def _deviation(ratios: Array, weights: Array) -> float:
    """How far the common factor of the stiffness is off where loads excite some modes more than others.

    It is the mean over all modes. A motion may excite those that are above it, or those below, not at all or twice as
    much as was assumed: by either, what the heavier of the two groups deviates by is missing.

    Args:
        ratios: Stiffness of the modes over that of a coarser mesh, shape [k].
        weights: Share of each in the deflection, in sum one, shape [k].
    """
    off = ratios - weights @ ratios
    above = float(weights[off > 0.0].sum())
    return 0.5 * float(weights @ np.abs(off)) / max(above, 1.0 - above)


def _largest(indicators: Array) -> IntArray:
    """The fewest elements that together have the marked share of the error."""
    order = np.argsort(-indicators, kind="stable")
    summed = np.cumsum(indicators[order])
    return np.asarray(order[: 1 + int(np.searchsorted(summed, MARKED * summed[-1]))])


def _clamped_nodes(mesh: QuadraticMesh, body: Body, carrier: Frame | None, cut: Sequence[CutPatch]) -> IntArray | None:
    assert body.flexible is not None
    if carrier is None:
        return None
    try:
        attachment = AttachmentFrame(body.path, carrier, "interface")
        return interface_patches(mesh, [attachment], body.flexible.interface_radius, body.path, cut)[0].nodes
    except ShotError:
        return None  # the reduction reports the error with the joint
