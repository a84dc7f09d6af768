"""One refinement of a finite-element mesh, and the error that two meshes tell.

A coarse mesh makes a body too stiff. The compliances that matter (of the first modes, and of the interfaces under the
loads) are computed on a mesh and on a finer one, whose elements are bisected where the error arises. Their error goes
with the number of nodes to the power of -3/2 (`MeshController.order`): the energy of the error of quadratic elements
goes with -4/3 where meshes are equally fine, and falls faster where edges at clamps become finer that were not; on ten
links of five robots it was 1.2 to 2.1. The difference of the two meshes so tells the compliance of ever finer ones, and
one factor corrects the stiffness. What an extrapolation leaves is mostly less than a third of its correction; three
times that is claimed, all of it.

Source: Richardson's extrapolation; Doerfler 1996, A Convergent Adaptive Algorithm for Poisson's Equation, for marking.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, Indices, box_diagonal
from calmotion.linear_algebra.multifrontal import FactorsTooLarge
from calmotion.mesh.bisection import bisected
from calmotion.mesh.parts import error_of_core
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.quadratic import quadratic_nodes
from calmotion.mesh.tetrahedra import min_dihedral_deg
from calmotion.model.character import Body, Frame
from calmotion.model.meshes import FEMesh
from calmotion.reduction.basis.fixed_interface import ritz_modes
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.cache import cached_reduction
from calmotion.reduction.discretization_error import element_errors
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.full_models import FullModels, Member, handed_on, room
from calmotion.reduction.load_envelope import LoadEnvelope, patch_load_envelope
from calmotion.reduction.reduce import FullBody

_OVER = 1.05  # of the nodes that a mesh may have


@dataclass(frozen=True, eq=False)
class Response:
    """Compliances of a body on a mesh.

    Attributes:
        nodes: Number of nodes of the quadratic tetrahedra.
        compliances: 1 / omega^2 of the first modes [s^2], then the displacement of the targets by the loads on the
            moving interfaces [m] where there are any, shape [k].
        weights: Of each in the mean, in sum one, shape [k].
        shares: Of each beside that of the first mode, at most one, shape [k]: what its error does to a deflection.
        error: Their relative error as strains that are recovered at the nodes tell it, the largest, of those of a shot
            with known loads by their shares; 0 where not judged.
        indicators: Part of each element in it, shape [m]; empty where not judged.
    """

    nodes: int
    compliances: Array
    weights: Array
    shares: Array
    error: float
    indicators: Array


@dataclass(frozen=True)
class MeshController:
    """Refines meshes, each at most once, and states the error that is left.

    Attributes:
        wanted: Relative error of the compliance that may be left.
        max_nodes: Of the quadratic tetrahedra of a finer mesh.
        keeps: `finer`: the finer elements are kept; `given`: the given ones as they are, with their error; otherwise
            the given ones with a factor of their stiffness where one factor fits all compliances, else the finer ones.
    """

    wanted: float
    max_nodes: int
    keeps: str = ""

    order = 1.5  # of the error in one over the number of nodes, see above
    modes = 3  # first modes that count
    left, safety = 1.0 / 3.0, 3.0  # share of a correction that is mostly left; claimed over that
    recovered = 0.4  # true error over that which strains tell, 0.2 to 1 on coarse meshes of links
    growth, fewest = (1.6, 8.0), 1.4  # nodes of the finer mesh over those of the given one; least that tells something
    marked = 0.3  # share of the error in the elements that are bisected at a time
    parted = 0.5  # of the wanted error: compliances that differ from one factor by less are corrected by one

    def refined(
        self, mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int | None,
        loads: LoadEnvelope | None = None, models: FullModels | None = None,
    ) -> FEMesh:  # fmt: skip
        """The mesh, or a finer one, with the stiffness of ever finer ones; its quality holds the error.

        Results are stored in the cache of reductions, but for those that another time more memory would make finer.

        Args:
            mesh: Of the body; a factor of its stiffness that is already known is found anew.
            body: With `flexible` settings.
            attachments: Frames of its joints and targets.
            root: Index of that of the joint to its parent; None: nothing holds it.
            loads: Of the body, one row for each moving attachment; None: equal forces on all.
            models: Full models that are known; those of the meshes with their own stiffness are added.

        Raises:
            ShotError: The body cannot be reduced.
        """
        own = replace(mesh, quality=replace(mesh.quality, stiffness_factor=1.0))
        key = ("refined", self, own, replace(body, surfaces=()), attachments, root, loads)  # skins do not matter
        try:
            return cached_reduction(key, lambda: self._refined(own, body, attachments, root, loads, models))
        except _NotFiner as kept:
            return kept.mesh

    def _refined(
        self, mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int | None,
        loads: LoadEnvelope | None, models: FullModels | None,
    ) -> FEMesh:  # fmt: skip
        if models is not None or root is None:
            return self._of_two(mesh, body, attachments, root, loads, models)
        handed_on.make_room()
        models = FullModels(keeps=True)
        result = self._of_two(mesh, body, attachments, root, loads, models)
        models.hand_on(Member(result, body, attachments, root))
        return result

    def _of_two(
        self, mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int | None,
        loads: LoadEnvelope | None, models: FullModels | None,
    ) -> FEMesh:  # fmt: skip
        coarse = response(mesh, body, attachments, root, loads, self.modes, models)
        nodes = self._nodes_of_finer(coarse)
        unrefined = self.safety * self.recovered * coarse.error
        if nodes < self.fewest * coarse.nodes:
            return _with_errors(mesh, body, 1.0, unrefined, unrefined)
        finer = bisected_to(mesh, coarse.indicators, nodes, self.marked, self.max_nodes)
        try:
            with room.of(nodes):
                fine = response(finer, body, attachments, root, loads, self.modes, models, judged=False)
        except FactorsTooLarge as error:
            raise _NotFiner(_with_errors(mesh, body, 1.0, unrefined, unrefined)) from error
        change, left = self.extrapolated(coarse, fine)
        whole = fine.compliances / coarse.compliances * (1.0 + change) - 1.0
        every = np.ones_like(coarse.shares)
        if self.keeps == "given":
            errors = (_largest_of(left, share) + _largest_of(np.abs(whole), share) for share in (every, coarse.shares))
            return _with_errors(mesh, body, 1.0, *errors)
        counted = every if loads is None else coarse.shares
        if self.keeps != "finer" and _deviation(whole, coarse.weights, counted) <= self.parted * self.wanted:
            finer, change = mesh, whole
        errors = (
            _largest_of(left, share) + _deviation(change, coarse.weights, share) for share in (every, coarse.shares)
        )
        return _with_errors(finer, body, 1.0 / (1.0 + float(coarse.weights @ change)), *errors)

    def _nodes_of_finer(self, coarse: Response) -> int:
        """Nodes with which the error of a finer mesh is expected to be as wanted, as far as they are allowed."""
        ratio = self.recovered * coarse.error / max(self.wanted, np.finfo(float).tiny)
        growth = float(np.clip(ratio ** (1.0 / self.order), *self.growth))
        return int(min(growth * coarse.nodes, self.max_nodes))

    def extrapolated(self, coarse: Response, fine: Response) -> tuple[Array, Array]:
        """What ever finer meshes add to the compliances of the finer of two, relative, and its errors, shape [k]."""
        difference = fine.compliances / coarse.compliances - 1.0
        change = difference / ((fine.nodes / coarse.nodes) ** self.order - 1.0)
        # a finer mesh that is stiffer tells nothing about ever finer ones
        return np.maximum(change, 0.0), self.safety * self.left * np.abs(change)


class _NotFiner(Exception):
    """There is not enough memory for a finer mesh.

    Attributes:
        mesh: The given one, with its error.
    """

    def __init__(self, mesh: FEMesh):
        super().__init__("there is not enough memory for a finer mesh")
        self.mesh = mesh


def response(
    mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int | None,
    loads: LoadEnvelope | None, modes: int, models: FullModels | None = None, judged: bool = True,
) -> Response:  # fmt: skip
    """The compliances of a body on a mesh; arguments and errors as of `MeshController.refined`.

    Args:
        modes: How many count.
        models: Full models that are known; that of the mesh is added.
        judged: Whether their error by recovered strains is computed as well.
    """
    settings = body.flexible
    assert settings is not None
    if root is None:
        model = assemble(mesh.points, mesh.tets, settings.material)
        frequencies, shapes = clamped_modes(model, modes)
        squares, moved = (2.0 * np.pi * frequencies) ** 2, (np.zeros((*model.mesh.nodes.shape, 0)), np.zeros(0))
    else:
        models = models or FullModels(keeps=False)
        full = models.of(Member(mesh, body, attachments, root))
        model, fixed = full.model, full.support.fixed(full.model)
        columns = fixed.lowest(modes)
        squares, U = ritz_modes(model, columns)
        squares = squares[:modes]
        shapes = (columns @ U[:, : len(squares)]).reshape(len(model.mesh.nodes), 3, -1)
        moved = _moved_by_loads(full, attachments, loads)
    fields, by_each = moved
    shares, by_load = squares[0] / squares, by_each / max(float(by_each.sum()), np.finfo(float).tiny)
    by_mode = shares / shares.sum()
    compliances, weights, count = 1.0 / squares, by_mode, len(squares)
    error, indicators = 0.0, np.zeros(0)
    if judged:
        errors = element_errors(model.mesh, settings.material, np.concatenate([shapes, fields], axis=2))
        total = errors.sum(axis=0)
        of_modes = total[:count] if loads is None else shares * total[:count]
        error = max(float(of_modes.max()), float(total[count:] @ by_load))
        indicators = errors[:, :count] @ by_mode + errors[:, count:] @ by_load
    if len(by_each):
        compliances = np.append(compliances, by_each.sum())
        weights, shares = np.append(0.5 * by_mode, 0.5), np.append(shares, 1.0)
    return Response(len(model.mesh.nodes), compliances, weights, shares, error, indicators)


def _moved_by_loads(
    full: FullBody, attachments: Sequence[AttachmentFrame], loads: LoadEnvelope | None
) -> tuple[Array, Array]:
    """Static responses to the loads on the moving interfaces, one component of one interface each.

    Returns:
        Displacements [m], shape [n, 3, 6p], and how far each component moves the targets, shape [6p].
    """
    fixed, nodes = full.support.fixed(full.model), full.model.mesh.nodes
    p = len(full.moving)
    if not p:
        return np.zeros((len(nodes), 3, 0)), np.zeros(0)
    size = box_diagonal(nodes)
    wrenches = levers = np.tile([1.0, 1.0, 1.0, size, size, size], p)
    if loads is not None:
        positions = np.array([attachment.frame.position for attachment in attachments]).reshape(-1, 3)
        own = patch_load_envelope(loads, [patch.attachments for patch in full.moving], positions, full.support.centers)
        wrenches = np.hstack([own.force, own.moment]).ravel()
        levers = np.hstack([np.ones_like(own.force), np.tile(own.lever_arm[:, None], 3)]).ravel()
    compliance = np.linalg.inv(fixed.patch_stiffness())
    moved = (levers @ np.abs(compliance)) * wrenches
    used = moved > 0.0
    fields = fixed.constraint @ (compliance * wrenches)[:, used]
    return fields.reshape(len(nodes), 3, -1), np.asarray(moved[used])


def bisected_to(mesh: FEMesh, indicators: Array, nodes: int, share: float, most: float = np.inf) -> FEMesh:
    """The mesh with elements bisected where the error arises, again and again, until it has so many nodes.

    Args:
        mesh: To refine.
        indicators: Part of each element in the error, shape [m].
        share: Of the error in the elements that are bisected at a time.
        most: Nodes that it may have, nearly.
    """
    points, tets, had = mesh.points, mesh.tets, quadratic_nodes(mesh.points, mesh.tets)
    while had < nodes and indicators.any():
        finer = bisected(points, tets, _largest(indicators, share))
        has = quadratic_nodes(*finer[:2])
        if has > _OVER * most:  # the last step is smaller
            finer = bisected(points, tets, _largest(indicators, share * (nodes - had) / (has - had)))
            has = quadratic_nodes(*finer[:2])
        (points, tets, parent), had = finer, has
        parts = np.bincount(parent, minlength=len(indicators)).astype(float)
        # the energy of the error of quadratic elements goes with the fourth power of their size
        indicators = (indicators * parts ** (-4.0 / 3.0) / parts)[parent]
    return replace(mesh, points=points, tets=tets)


def root_at(attachments: Sequence[AttachmentFrame], carrier: Frame | None) -> int | None:
    """Index of the attachment frame of the joint to the parent, None without one.

    Args:
        carrier: Frame of that joint on the body.
    """
    if carrier is None:
        return None
    same = (np.array_equal(own.frame.position, carrier.position) for own in attachments)
    return next((k for k, at in enumerate(same) if at and attachments[k].kind == "interface"), None)


def _largest_of(errors: Array, shares: Array) -> float:
    """The largest of errors, each by its share."""
    return float((shares * errors).max())


def _deviation(changes: Array, weights: Array, shares: Array) -> float:
    """How far changes are from their mean, each by its share: what one factor of the stiffness leaves of them."""
    return _largest_of(np.abs(changes - weights @ changes), shares)


def _with_errors(mesh: FEMesh, body: Body, factor: float, error: float, of_deflection: float) -> FEMesh:
    """The mesh with a factor of its stiffness and the errors of its compliances, with those of its volume and core.

    Args:
        mesh: Of the body.
        factor: Of its stiffness.
        error: Relative, the largest.
        of_deflection: The same, each by its share.
    """
    assert body.flexible is not None
    known = mesh.quality.error_of_solid + error_of_core(mesh.points, mesh.tets, body.flexible.material.core)
    quality = replace(
        mesh.quality,
        frequency_error=0.5 * (error + known),
        deflection_error=of_deflection + known,
        stiffness_factor=factor,
        min_dihedral_deg=min_dihedral_deg(mesh.points, mesh.tets),
    )
    return replace(mesh, quality=quality)


def _largest(indicators: Array, share: float) -> Indices:
    """The fewest elements that together have a share of the error."""
    order = np.argsort(-indicators, kind="stable")
    summed = np.cumsum(indicators[order])
    return np.asarray(order[: 1 + int(np.searchsorted(summed, share * summed[-1]))])
