"""Inertia integrals of a component from nodal fields and the scalar mass matrix.

Each integral is int rho A B^T = A^T m B for nodal fields A, B of shape [n, 3].
"""

from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.reduced_body import Invariants


def inertia_integrals(nodes: Array, mass: Any, modes: Array) -> Invariants:
    """The invariants of a component.

    Args:
        nodes: Nodal points [m], shape [n, 3], body frame.
        mass: Scalar mass matrix [kg], sparse, shape [n, n].
        modes: Nodal displacement of each mode, shape [n, 3, r], body axes.

    Source: Seed (11)-(18); docs/formulation.md, "A flexible body".
    """
    n, _, r = modes.shape
    flat = np.ascontiguousarray(modes.reshape(n, 3 * r))
    mX = mass @ nodes
    m1 = np.asarray(mass @ np.ones(n))
    mPhi = mass @ flat
    # [3 r, 3 r] -> S[j, k, a, b] = int rho phi_j,a phi_k,b
    gram = flat.T @ mPhi
    S = 0.5 * (gram + gram.T).reshape(3, r, 3, r).transpose(1, 3, 0, 2)
    Z = nodes.T @ mX
    return Invariants(
        mass=float(m1.sum()),
        s=nodes.T @ m1,
        Z=0.5 * (Z + Z.T),
        M=np.einsum("jkaa->jk", S),
        M3=(flat.T @ m1).reshape(3, r).T.copy(),
        M4=(nodes.T @ mPhi).reshape(3, 3, r).transpose(2, 0, 1).copy(),
        S=np.ascontiguousarray(S),
    )
