"""The unreduced truth: a hyperelastic body in inertial coordinates, every node free, the root led by the hand.

Written from the equations, with nothing of `calmotion.fem` but the mesh: Total Lagrangian, ten-node tetrahedra,
positions of all nodes as unknowns, so that large rotations are in the Green strain and need no floating frame.
"""

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, diags, identity, kron
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

_STEADY = 0.8  # of motion far too fast for a step, which it leaves; at 1 a long beam that spins up breaks down
_BETTER = 0.3  # of the last correction: a kept tangent has to do better than that


class FullOrder:
    """Straight-sided ten-node tetrahedra of hyperelastic materials.

    Args:
        points, tets: Linear mesh, [n, 3] and [m, 4].
        youngs_modulus, poissons_ratio, density: SI.
        law: `stvk` or `neohookean` (W = mu/2 (tr C - 3) - mu ln J + lambda/2 ln^2 J).
        lumps: Extra masses [kg] by node of the linear mesh.

    Attributes:
        nodes: [m], shape [n', 3]: the points, then the midpoints of edges.
        mass: Consistent, with the lumps [kg], shape [3 n', 3 n'].
    """

    def __init__(self, points, tets, youngs_modulus, poissons_ratio, density, law="stvk", lumps=None):
        from skfem import Basis, ElementTetP2, MeshTet

        mesh = MeshTet(np.ascontiguousarray(points.T, dtype=float), np.ascontiguousarray(tets.T, dtype=np.int64))
        basis = Basis(mesh, ElementTetP2(), intorder=4)
        self.nodes = basis.doflocs.T.copy()
        self.tets = basis.element_dofs.T.astype(np.int64)
        self.gradients = np.stack([np.asarray(f[0].grad) for f in basis.basis]).transpose(2, 3, 0, 1)  # [e, q, 10, 3]
        # one matrix for each element, which is far faster than a sum over indices: [e, q 3, 10]
        self._gradient = np.swapaxes(self.gradients, -1, -2).reshape(len(self.tets), -1, 10).copy()
        values = np.stack([np.asarray(f[0]) * np.ones(basis.dx.shape) for f in basis.basis])
        self.weights = basis.dx
        self.mu = 0.5 * youngs_modulus / (1.0 + poissons_ratio)
        self.lame = 2.0 * self.mu * poissons_ratio / (1.0 - 2.0 * poissons_ratio)
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
        keys = 3 * n * np.tile(dofs, (1, 30)).ravel() + np.repeat(dofs, 30, axis=1).ravel()
        keys, self._place = np.unique(keys, return_inverse=True)
        self._rows, self._starts = keys % (3 * n), np.searchsorted(keys, 3 * n * np.arange(3 * n + 1))

    def deformation(self, x):
        """F at every quadrature point, [e, q, 3, 3], of nodal positions [n, 3]."""
        F = (self._gradient @ x[self.tets]).reshape(*self.weights.shape, 3, 3)
        return np.swapaxes(F, -1, -2)

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
        F, lame, mu = self.deformation(x), self.lame, self.mu
        if self.law == "stvk":
            E = 0.5 * (np.swapaxes(F, -1, -2) @ F - np.eye(3))
            S = lame * np.trace(E, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) + 2.0 * mu * E
            P = F @ S
        else:
            inverse = np.linalg.inv(F)
            log = np.log(np.linalg.det(F))[..., None, None]
            transposed = np.swapaxes(inverse, -1, -2)
            P = mu * (F - transposed) + lame * log * transposed
        G, w = self.gradients, self.weights
        weighted = (np.swapaxes(P, -1, -2) * w[:, :, None, None]).reshape(len(P), -1, 3)
        local = np.swapaxes(self._gradient, -1, -2) @ weighted
        f = np.bincount(self._dofs.ravel(), weights=local.ravel(), minlength=3 * len(self.nodes))
        if not tangent:
            return f, None
        by_lame, by_mu = w * lame, w * mu
        if self.law == "stvk":
            # dP = dF S + F (lame tr(F^T dF) + mu (dF^T F + F^T dF)), dF = e_i (x) G_a
            FG = np.einsum("eqij,eqaj->eqai", F, G)
            K = np.einsum("eqai,eqbk,eq->eaibk", FG, FG, by_lame, optimize=True)
            K += np.einsum("eqak,eqbi,eq->eaibk", FG, FG, by_mu, optimize=True)
            GG = np.einsum("eqaj,eqbj->eqab", G, G)
            K += np.einsum("eqab,eqij,eqkj,eq->eaibk", GG, F, F, by_mu, optimize=True)
            geometric = np.einsum("eqaj,eqjl,eqbl,eq->eab", G, S, G, w, optimize=True)
        else:
            H = np.einsum("eqji,eqaj->eqai", inverse, G)  # F^-T G
            K = np.einsum("eqai,eqbk,eq->eaibk", H, H, by_lame, optimize=True)
            K += np.einsum("eqak,eqbi,eq->eaibk", H, H, by_mu - by_lame * log[..., 0, 0], optimize=True)
            geometric = np.einsum("eqaj,eqbj,eq->eab", G, G, by_mu, optimize=True)
        for i in range(3):
            K[:, :, i, :, i] += geometric
        size = len(f)
        data = np.bincount(self._place, weights=K.ravel(), minlength=len(self._rows))
        return f, csc_matrix((data, self._rows, self._starts), shape=(size, size))

    def statics(self, held, loads, steps=10):
        """Positions [n, 3] in balance with nodal forces [n, 3], nodes `held` staying where they are."""
        x = self.nodes.copy()
        free = self._free(held)
        for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
            for _ in range(40):
                f, K = self.forces(x)
                residual = (part * loads.ravel() - f)[free]
                dx = np.zeros(x.size)
                dx[free] = _factor(K[free][:, free]).solve(residual)
                x += dx.reshape(-1, 3)
                if np.abs(dx).max() < 1e-12 * np.ptp(self.nodes):
                    break
            else:
                raise ArithmeticError(f"no balance at {part:.0%} of the load; take more steps")
        return x

    def swing(self, held, angle, axis, step, duration, watched):
        """Root nodes turned about an axis through the origin by angle(t), which starts from zero, from rest.

        Returns:
            Times, and positions of the watched nodes turned back by the angle, [t, k, 3].
        """
        tips = [turn.inv().apply(x[watched]) for x, turn in self.march(step, round(duration / step), held, angle, axis)]
        return step * np.arange(len(tips)), np.array(tips)

    def march(self, step, count, held, angle, axis):
        """Positions [n, 3] and turns of the root, the first ones included; generalised alpha, of second order.

        A tangent is kept, and turned with the root, as long as it does its work (modified Newton).

        Source: Chung and Hulbert 1993.
        """
        by_a, by_f = (2.0 * _STEADY - 1.0) / (_STEADY + 1.0), _STEADY / (_STEADY + 1.0)  # weights of the last step
        gamma, beta = 0.5 - by_a + by_f, 0.25 * (1.0 - by_a + by_f) ** 2
        held = np.asarray(held, dtype=np.int64)
        free, n = self._free(held), len(self.nodes)
        M, h = self.mass, step
        led = _Lead(self.nodes[held], angle, np.asarray(axis, dtype=float))
        x, v, a = self.nodes.copy(), np.zeros((n, 3)), np.zeros((n, 3))
        turn, _, v[held], a[held] = led(0.0)
        f_last = self.forces(x, False)[0]
        a.reshape(-1)[free] = _factor(M[free][:, free]).solve((-f_last - M @ a.ravel())[free])
        yield x, turn
        inside = np.ones(n, dtype=bool)
        inside[held] = False
        lu, factored = None, turn
        for k in range(1, count + 1):
            # the guess: what bends goes on as it did, seen from the root
            spin, since = led.spin, turn.inv()
            turn, place, rate, acceleration = led(k * h)
            since = turn * since
            guess = since.apply(x + h * (v - np.cross(spin, x)))
            guess[held] = place
            new, own, renew, last = guess.copy(), False, lu is None, np.inf
            for _ in range(60):
                a_new = (new - x - h * v - (0.5 - beta) * h**2 * a) / (beta * h**2)
                v_new = v + h * ((1.0 - gamma) * a + gamma * a_new)
                a_new[held], v_new[held] = acceleration, rate
                f, K = self.forces(new, renew)
                if renew:
                    own, renew = True, False
                    matrix = (1.0 - by_f) * K + (1.0 - by_a) / (beta * h**2) * M
                    lu, factored = _factor(matrix[free][:, free]), turn
                inertia = M @ ((1.0 - by_a) * a_new + by_a * a).ravel()
                residual = (-(1.0 - by_f) * f - by_f * f_last - inertia).reshape(-1, 3)[inside]
                since = turn * factored.inv()
                dx = since.apply(lu.solve(since.inv().apply(residual).ravel()).reshape(-1, 3))
                new[inside] += dx
                size = np.abs(dx).max()
                if size < 1e-10 * np.ptp(self.nodes):
                    break
                renew = size > _BETTER * last
                if renew and not own:
                    new, size = guess.copy(), np.inf  # it has bent too far since: from the start
                last = size
            else:
                raise ArithmeticError(f"no balance at {k * h:.4g} s; take a smaller step")
            x, v, a, f_last = new, v_new, a_new, f
            yield x, turn

    def _free(self, held):
        free = np.ones(len(self.nodes), dtype=bool)
        free[held] = False
        return np.flatnonzero(np.repeat(free, 3))


class _Lead:
    """Where nodes that turn with an angle are, and their velocities and accelerations."""

    def __init__(self, nodes, angle, axis):
        self.nodes, self.angle, self.axis = nodes, angle, axis / np.linalg.norm(axis)

    def __call__(self, t, d=1e-4):
        before, now, after = (float(self.angle(s)) for s in (t - d, t, t + d))
        spin, acceleration = (after - before) / (2.0 * d), (after - 2.0 * now + before) / d**2
        turn, self.spin = Rotation.from_rotvec(self.axis * now), spin * self.axis
        place = turn.apply(self.nodes)
        across = np.cross(self.axis, place)
        return turn, place, spin * across, acceleration * across + spin**2 * np.cross(self.axis, across)


def _factor(matrix):
    """Of a symmetric matrix."""
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
