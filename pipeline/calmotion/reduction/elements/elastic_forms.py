"""Second-order internal forces of hyperelastic materials on the full mesh, and the strain fields of modes.

With displacement gradient G of the body (F = E + G), the first Piola-Kirchhoff stress of a material expands about
the undeformed state as P = C:sym(G) + P''[G, G]/2 + ..., where P''[A, B] is symmetric in A and B.
"""

import numpy as np
from scipy.linalg.blas import dsyrk

from calmotion.arrays import Array
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.reduction.elements.assembly import corner_gradients
from calmotion.reduction.elements.green_strain_fields import green_fields
from calmotion.reduction.elements.second_order_forces import add_second_order_forces
from calmotion.support import interrupts

# Order of the rule of elastic laws. It is exact for small strains of quadratic elements, as their order of convergence
# needs (Ciarlet, The Finite Element Method for Elliptic Problems, 1978, section 4.1). Rules that are exact for products
# of quadratic strains have eleven points in place of four, and let coarse elements lock more: a linkage that shakes by
# 230 mm was off by 3.3 mm with elements of 35 mm, and is by 1.3 mm.
LAW_ORDER = 2
_CHUNK = 2_000_000  # numbers: fields of about 16 MB at a time stay in the processor's cache


class GradientRule:
    """Displacement gradients at the quadrature points of every element.

    Args:
        mesh: Of the body, m elements.
        order: Polynomial degree that the rule integrates exactly. The rule of a printed part, weighted by its relative
            modulus, is of order 2.
        solid: Whether the rule ignores what a printed part is filled with.

    Attributes:
        points: Quadrature points in the reference tetrahedron, shape [3, q]; not those of a printed part.
        weights: Quadrature weights times volume [m^3], shape [m, q].
    """

    def __init__(self, mesh: QuadraticMesh, order: int, solid: bool = False):
        from skfem import Basis, ElementTetP2

        basis = Basis(mesh.basis.mesh, ElementTetP2(), intorder=order)
        self._shape = np.stack([np.asarray(field[0].grad) for field in basis.basis])  # [10, 3, m, q]
        self._tets = mesh.tets
        self._nodes = len(mesh.nodes)
        self.points: Array = basis.X
        self.weights: Array = np.ascontiguousarray(basis.dx)
        if mesh.filling is not None and not solid:
            at_points = np.einsum("ajec,eqc->ajeq", corner_gradients(mesh), mesh.filling.points, optimize=True)
            self._shape = np.ascontiguousarray(at_points)
            self.weights = basis.dx.sum(axis=1)[:, None] * mesh.filling.weights

    def gradients(self, modes: Array, elements: slice = slice(None)) -> Array:
        """G_ij = d(displacement i)/dX_j of nodal fields of shape [n, 3, r]; shape [r, m, q, 3, 3]."""
        local = modes[self._tets[elements]]  # [m, 10, 3, r]
        return np.asarray(np.einsum("eair,ajeq->reqij", local, self._shape[:, :, elements], optimize=True))

    def internal_force(self, displacement: Array, lame: float, mu: float) -> Array:
        """Of a St. Venant-Kirchhoff body [N], shape [n, 3], at nodal displacements of that shape [m]."""
        G = self.gradients(displacement[:, :, None])[0]
        Gt = np.swapaxes(G, -1, -2)
        stress = linear_stress(0.5 * (G + Gt + Gt @ G), lame, mu)
        local = np.einsum("eqij,ajeq,eq->eai", stress + G @ stress, self._shape, self.weights, optimize=True)
        force = np.zeros((self._nodes, 3))
        np.add.at(force, self._tets, local)
        return force

    def second_order_force(self, A: Array, B: Array, lame: float, mu: float, material: str) -> Array:
        """Second derivative of the internal force in the directions of two fields [N], shape [n, 3].

        Args:
            A, B: Gradients of the fields at the points, shape [m, q, 3, 3].
            lame, mu: Lame's constants [Pa].
            material: `stvk` (St. Venant-Kirchhoff) or `neohookean`.
        """
        force = np.zeros((self._nodes, 3))
        stvk, scratch = material == "stvk", np.empty((4, 3, 3))
        add_second_order_forces(self._tets, self._shape, self.weights, A, B, lame, mu, stvk, scratch, force)
        return force


def linear_stress(G: Array, lame: float, mu: float) -> Array:
    """C : sym(G) [Pa], shape of G [..., 3, 3]."""
    trace = np.trace(G, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray(mu * (G + np.swapaxes(G, -1, -2)) + lame * trace * np.eye(3))


def lame_constants(youngs_modulus: float, poissons_ratio: float) -> tuple[float, float]:
    """Lame's constants (lambda, mu) [Pa]."""
    mu = 0.5 * youngs_modulus / (1.0 + poissons_ratio)
    return 2.0 * mu * poissons_ratio / (1.0 - 2.0 * poissons_ratio), mu


def gradient_gram(rule: GradientRule, modes: Array) -> Array:
    """Inner products of the displacement gradients of modes, int G_k : G_l [m], shape [r, r].

    Args:
        rule: Of order 2, which integrates them exactly.
        modes: Nodal displacements, shape [n, 3, r].
    """
    r, (count, points) = modes.shape[2], rule.weights.shape
    gram, chunk = np.zeros((r, r)), max(1, _CHUNK // (9 * points * max(r, 1)))
    for start in range(0, count, chunk):
        interrupts.check()
        elements = slice(start, start + chunk)
        G = rule.gradients(modes, elements) * np.sqrt(rule.weights[elements])[:, :, None, None]
        G = G.reshape(r, -1)
        gram += G @ G.T
    return gram


def strain_gram(rule: GradientRule, modes: Array, lame: float, mu: float, directions: Array | None = None) -> Array:
    """Inner products of the Green strains of modes and of pairs of modes.

    The Green strain of a displacement sum_k u_k phi_k is a combination of fields, one for each mode and one for each
    pair of modes, with the coefficients z(u) = (u_k; u_k u_l for k <= l). Hence the energy of a St. Venant-Kirchhoff
    body is exactly z^T A z / 2 with A_ab = int E_a : C : E_b: the force is a cubic polynomial whose coefficients
    are in A. It is a Gram matrix, so the energy is never negative, and that of a rigid rotation is none by any rule.

    Args:
        rule: Without negative weights.
        modes: Nodal displacements, shape [n, 3, r].
        lame, mu: Lame's constants [Pa].
        directions: Basis of the subspace of the quadratic strain, shape [r, p]; None: all coordinates.

    Returns:
        A, symmetric, shape [r + p (p + 1) / 2] squared; pairs ordered (0, 0), (0, 1), ..., (1, 1), ...

    Source: Barbic and James, Real-Time Subspace Integration for St. Venant-Kirchhoff Deformable Models, 2005 (the
    cubic polynomial), in the form of a Gram matrix.
    """
    r = modes.shape[2]
    p = r if directions is None else directions.shape[1]
    size = r + p * (p + 1) // 2
    A = np.zeros((size, size), order="F")  # its upper triangle
    count, points = rule.weights.shape
    chunk = max(1, _CHUNK // (7 * points * size))
    # the energy density 2 mu |E|^2 + lame tr(E)^2 as a sum of squares
    shear = np.sqrt(2.0 * mu)
    bulk = (np.sqrt(2.0 * mu + 3.0 * lame) - shear) / 3.0
    for start in range(0, count, chunk):
        interrupts.check()  # in a thread, where no signal arrives
        elements = slice(start, min(start + chunk, count))
        G = np.ascontiguousarray(rule.gradients(modes, elements).reshape(r, -1, 9).transpose(0, 2, 1))
        H = G if directions is None else np.tensordot(directions.T, G, 1)
        fields = np.empty((size, 6, G.shape[2]))
        green_fields(G, H, np.sqrt(rule.weights[elements].ravel()), shear, bulk, fields)
        dsyrk(1.0, fields.reshape(size, -1).T, beta=1.0, c=A, trans=1, overwrite_c=1)
    return np.ascontiguousarray(A + np.triu(A, 1).T)
