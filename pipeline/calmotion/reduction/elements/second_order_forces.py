"""Nodal forces of the second-order stress of a hyperelastic material; compiled."""

from calmotion.arrays import Array, IntArray
from calmotion.support.compilation import inlined_kernel, kernel


@inlined_kernel
def _linear_stress(G: Array, lame: float, mu: float, out: Array) -> None:
    """C : sym(G) of a displacement gradient."""
    trace = lame * (G[0, 0] + G[1, 1] + G[2, 2])
    for i in range(3):
        for j in range(3):
            out[i, j] = mu * (G[i, j] + G[j, i])
        out[i, i] += trace


@kernel
def add_second_order_forces(
    tets: IntArray, shape: Array, weights: Array, A: Array, B: Array, lame: float, mu: float, stvk: bool,
    scratch: Array, force: Array,
) -> None:  # fmt: skip
    """Add int P''[A, B] : grad N, the second derivative of the internal force in two directions.

    Args:
        tets: Nodes of the elements, shape [m, 10].
        shape: Gradients of the shape functions at the points, shape [10, 3, m, q].
        weights: Of the points [m^3], shape [m, q].
        A, B: Displacement gradients of the directions, shape [m, q, 3, 3].
        lame, mu: Lame's constants [Pa].
        stvk: St. Venant-Kirchhoff; else neo-Hookean.
        scratch: Shape [4, 3, 3].
        force: Added to, shape [n, 3] [N].

    Source: the second derivative of S = C:E, P = F S with E = sym(G) + G^T G/2, or of
    P = mu (F - F^-T) + lame ln(J) F^-T, at F = E.
    """
    P, of_a, of_b, product = scratch[0], scratch[1], scratch[2], scratch[3]
    for e in range(len(tets)):
        for q in range(weights.shape[1]):
            a, b = A[e, q], B[e, q]
            if stvk:  # C:sym(A^T B) + A C:sym(B) + B C:sym(A)
                for i in range(3):
                    for j in range(3):
                        product[i, j] = a[0, i] * b[0, j] + a[1, i] * b[1, j] + a[2, i] * b[2, j]
                _linear_stress(product, lame, mu, P)
                _linear_stress(a, lame, mu, of_a)
                _linear_stress(b, lame, mu, of_b)
                for i in range(3):
                    for j in range(3):
                        for k in range(3):
                            P[i, j] += a[i, k] * of_b[k, j] + b[i, k] * of_a[k, j]
            else:  # -mu (A^T B^T + B^T A^T) - lame (tr(A) B^T + tr(B) A^T + tr(A B) 1)
                trace_a, trace_b = a[0, 0] + a[1, 1] + a[2, 2], b[0, 0] + b[1, 1] + b[2, 2]
                trace = 0.0
                for i in range(3):
                    for j in range(3):
                        trace += a[i, j] * b[j, i]
                        P[i, j] = -lame * (trace_a * b[j, i] + trace_b * a[j, i])
                        for k in range(3):
                            P[i, j] -= mu * (a[k, i] * b[j, k] + b[k, i] * a[j, k])
                for i in range(3):
                    P[i, i] -= lame * trace
            for n in range(10):
                node = tets[e, n]
                for i in range(3):
                    f = P[i, 0] * shape[n, 0, e, q] + P[i, 1] * shape[n, 1, e, q] + P[i, 2] * shape[n, 2, e, q]
                    force[node, i] += weights[e, q] * f
