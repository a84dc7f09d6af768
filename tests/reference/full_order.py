"""The unreduced truth: a hyperelastic body in inertial coordinates, every node free, the root led by the hand.

Written from the equations, with nothing of `calmotion.fem` but the mesh: Total Lagrangian, ten-node tetrahedra,
positions of all nodes as unknowns, so that large rotations are in the Green strain and need no floating frame.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, diags, identity, kron
from scipy.sparse.linalg import splu


class FullOrder:
    """Straight-sided ten-node tetrahedra of one hyperelastic material.

    Args:
        points, tets: Linear mesh, [n, 3] and [m, 4].
        youngs_modulus, poissons_ratio, density: SI.
        law: `stvk` or `neohookean`.
        lumps: Extra masses [kg] by node of the linear mesh.
    """

    def __init__(self, points, tets, youngs_modulus, poissons_ratio, density, law="stvk", lumps=None):
        from skfem import Basis, ElementTetP2, MeshTet

        mesh = MeshTet(np.ascontiguousarray(points.T, dtype=float), np.ascontiguousarray(tets.T, dtype=np.int64))
        basis = Basis(mesh, ElementTetP2(), intorder=4)
        self.nodes = basis.doflocs.T.copy()
        self.tets = basis.element_dofs.T.astype(np.int64)
        self.gradients = np.stack([np.asarray(f[0].grad) for f in basis.basis]).transpose(2, 3, 0, 1)  # [e, q, 10, 3]
        values = np.stack([np.asarray(f[0].value) * np.ones(basis.dx.shape) for f in basis.basis])
        self.weights = basis.dx
        self.mu = 0.5 * youngs_modulus / (1.0 + poissons_ratio)
        self.lame = youngs_modulus * poissons_ratio / ((1.0 + poissons_ratio) * (1.0 - 2.0 * poissons_ratio))
        self.law = law
        local = density * np.einsum("aeq,beq,eq->eab", values, values, self.weights, optimize=True)
        n = len(self.nodes)
        rows, columns = np.repeat(self.tets, 10, axis=1).ravel(), np.tile(self.tets, (1, 10)).ravel()
        scalar = coo_matrix((local.ravel(), (rows, columns)), shape=(n, n)).tocsr()
        extra = np.zeros(n)
        for node, mass in (lumps or {}).items():
            extra[node] += mass
        self.mass = kron(scalar + diags(extra), identity(3), format="csr")
        dofs = (3 * self.tets[:, :, None] + np.arange(3)).reshape(-1, 30)
        self._dofs = dofs
        self._pattern = (np.repeat(dofs, 30, axis=1).ravel(), np.tile(dofs, (1, 30)).ravel())

    def deformation(self, x):
        """F at every quadrature point, [e, q, 3, 3], of nodal positions [n, 3]."""
        return np.einsum("eai,eqaj->eqij", x[self.tets], self.gradients, optimize=True)

    def energy(self, x):
        """Elastic energy [J]."""
        F = self.deformation(x)
        if self.law == "stvk":
            E = 0.5 * (np.swapaxes(F, -1, -2) @ F - np.eye(3))
            W = 0.5 * self.lame * np.trace(E, axis1=-2, axis2=-1) ** 2 + self.mu * np.sum(E * E, axis=(-2, -1))
        else:
            log = np.log(np.linalg.det(F))
            W = 0.5 * self.mu * (np.sum(F * F, axis=(-2, -1)) - 3.0) - self.mu * log + 0.5 * self.lame * log**2
        return float(np.sum(self.weights * W))

    def forces(self, x, tangent=True):
        """Internal force [3 n] and its derivative (sparse) at nodal positions [n, 3]."""
        F = self.deformation(x)
        E3 = np.eye(3)
        lame, mu = self.lame, self.mu
        if self.law == "stvk":
            E = 0.5 * (np.swapaxes(F, -1, -2) @ F - E3)
            S = lame * np.trace(E, axis1=-2, axis2=-1)[..., None, None] * E3 + 2.0 * mu * E
            P = F @ S
        else:
            inverse = np.linalg.inv(F)
            log = np.log(np.linalg.det(F))[..., None, None]
            transposed = np.swapaxes(inverse, -1, -2)
            P = mu * (F - transposed) + lame * log * transposed
        G, w = self.gradients, self.weights
        f = np.zeros(3 * len(self.nodes))
        np.add.at(f, self._dofs, np.einsum("eqij,eqaj,eq->eai", P, G, w, optimize=True).reshape(-1, 30))
        if not tangent:
            return f, None
        if self.law == "stvk":
            # dP = dF S + F (lame tr(F^T dF) + mu (dF^T F + F^T dF)), dF = e_i (x) G_a
            FG = np.einsum("eqij,eqaj->eqai", F, G)
            K = lame * np.einsum("eqai,eqbk,eq->eaibk", FG, FG, w, optimize=True)
            K += mu * np.einsum("eqak,eqbi,eq->eaibk", FG, FG, w, optimize=True)
            GG = np.einsum("eqaj,eqbj->eqab", G, G)
            K += mu * np.einsum("eqab,eqij,eqkj,eq->eaibk", GG, F, F, w, optimize=True)
            geometric = np.einsum("eqaj,eqjl,eqbl,eq->eab", G, S, G, w, optimize=True)
        else:
            H = np.einsum("eqji,eqaj->eqai", inverse, G)  # F^-T G
            K = lame * np.einsum("eqai,eqbk,eq->eaibk", H, H, w, optimize=True)
            K += np.einsum("eqak,eqbi,eq->eaibk", H, H, w * (mu - lame * log[..., 0, 0]), optimize=True)
            geometric = mu * np.einsum("eqaj,eqbj,eq->eab", G, G, w, optimize=True)
        for i in range(3):
            K[:, :, i, :, i] += geometric
        size = len(f)
        return f, coo_matrix((K.reshape(-1), self._pattern), shape=(size, size)).tocsc()

    def statics(self, held, loads, steps=10):
        """Positions [n, 3] in balance with nodal forces [n, 3], nodes `held` staying where they are."""
        x = self.nodes.copy()
        free = self._free(held)
        for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
            for _ in range(40):
                f, K = self.forces(x)
                residual = (part * loads.ravel() - f)[free]
                dx = np.zeros(x.size)
                dx[free] = splu(K[free][:, free].tocsc()).solve(residual)
                x += dx.reshape(-1, 3)
                if np.abs(dx).max() < 1e-12 * np.ptp(self.nodes):
                    break
        return x

    def swing(self, held, angle, axis, step, duration, watched, gravity=(0.0, 0.0, 0.0)):
        """Root nodes turned about an axis through the origin by angle(t); average acceleration (Newmark).

        Starts at rest, undeformed.

        Returns:
            Times, and positions of the watched nodes turned back by the angle, [t, k, 3].
        """
        from scipy.spatial.transform import Rotation

        free = self._free(held)
        M = self.mass
        weight = M @ np.tile(gravity, len(self.nodes))
        count = round(duration / step)
        x, v = self.nodes.copy().ravel(), np.zeros(self.nodes.size)
        a = np.zeros_like(v)
        tips = [self.nodes[watched]]
        for n in range(1, count + 1):
            turn = Rotation.from_rotvec(np.asarray(axis) * angle(n * step))
            led = turn.apply(self.nodes[held])
            new = x + step * v + 0.5 * step * step * a
            new.reshape(-1, 3)[held] = led
            for _ in range(30):
                acceleration = 4.0 / step**2 * (new - x - step * v) - a
                f, K = self.forces(new.reshape(-1, 3))
                residual = (weight - f - M @ acceleration)[free]
                matrix = (K + 4.0 / step**2 * M)[free][:, free]
                dx = splu(matrix.tocsc()).solve(residual)
                new[free] += dx
                if np.abs(dx).max() < 1e-10 * np.ptp(self.nodes):
                    break
            acceleration = 4.0 / step**2 * (new - x - step * v) - a
            v = v + 0.5 * step * (a + acceleration)
            x, a = new, acceleration
            tips.append(turn.inv().apply(x.reshape(-1, 3)[watched]))
        return step * np.arange(count + 1), np.array(tips)

    def _free(self, held):
        free = np.ones(len(self.nodes), dtype=bool)
        free[held] = False
        return np.flatnonzero(np.repeat(free, 3))
