"""The swung arm, unreduced: a slender beam with a rigid cube around the middle of its end, on a driven hinge.

from swung_arm import SwungArm, quintic
arm = SwungArm(youngs_modulus=1.8e9, law="stvk", cells=(30, 1, 1))
t, tip = arm.swing(quintic(np.pi / 2, 0.5), step=1e-3, duration=1.0)   # tip: along and across, as the hinge turns
along, across = arm.pushed(20.0)                                       # static load across the end
"""

import itertools

import numpy as np
from full_order import FullOrder

LENGTH, THICKNESS = 0.6, 0.02
PAYLOAD, EDGE = 0.2, 0.04
RIGID = 1e2  # times the modulus of the arm


def kuhn_box(*ticks):
    """Points [n, 3] and tetrahedra [m, 4] of the bricks between ticks along the axes, six to a brick.

    Every brick is cut alike, around the diagonal from its lowest corner to its highest, so that faces match.
    """
    counts = [len(t) for t in ticks]
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(counts)
    tets = []
    for order in itertools.permutations(range(3)):
        at, corners = [0, 0, 0], []
        for axis in (None, *order):
            if axis is not None:
                at[axis] = 1
            corners.append(number[tuple(slice(a, n - 1 + a) for a, n in zip(at, counts, strict=True))].ravel())
        swapped = np.linalg.det(np.eye(3)[list(order)]) < 0.0
        tets.append(np.stack([corners[i] for i in ((0, 2, 1, 3) if swapped else (0, 1, 2, 3))], axis=1))
    return points, np.concatenate(tets)


def quintic(turn, duration):
    """Angle(t) of a move from rest to rest [rad]."""

    def angle(t):
        s = np.clip(t / duration, 0.0, 1.0)
        return turn * (10 * s**3 - 15 * s**4 + 6 * s**5)

    return angle


class SwungArm:
    """The beam lies along x; the hinge through the origin turns about -y, which lifts the tip to +z.

    Args:
        youngs_modulus: Of the arm [Pa].
        law: `stvk` or `neohookean`.
        cells: Bricks of six tetrahedra along x, y, z; y and z alike.
        payload: Mass of the cube [kg], uniform; 0 leaves it out.
        poissons_ratio, density: Of the arm.
        retardation: Kelvin-Voigt time [s].
        length, thickness: [m].
    """

    def __init__(
        self, youngs_modulus=1.8e9, law="stvk", cells=(30, 1, 1), payload=PAYLOAD, poissons_ratio=0.35, density=1200.0,
        retardation=0.0, length=LENGTH, thickness=THICKNESS,
    ):  # fmt: skip
        half = thickness / 2
        across = [np.linspace(-half, half, n + 1) for n in cells[1:]]
        points, tets = kuhn_box(np.linspace(0.0, length, cells[0] + 1), *across)
        modulus, mass = np.full(len(tets), youngs_modulus), np.full(len(tets), density)
        if payload:
            # it goes through the arm's end, and holds only the nodes of the end face
            e = EDGE / 2
            cube, more = kuhn_box(length + np.array([-e, 0.0, e]), *(np.r_[-e, ticks, e] for ticks in across))
            end = {tuple(np.round(p / half, 6)): i for i, p in enumerate(points) if p[0] > length - 1e-9 * length}
            number = np.array([end.get(tuple(np.round(p / half, 6)), -1) for p in cube])
            new = number < 0
            number[new] = len(points) + np.arange(new.sum())
            points, tets = np.vstack([points, cube[new]]), np.vstack([tets, number[more]])
            modulus = np.r_[modulus, np.full(len(more), RIGID * youngs_modulus)]
            mass = np.r_[mass, np.full(len(more), payload / EDGE**3)]
        self.full = FullOrder(points, tets, modulus, poissons_ratio, mass, law, retardation=retardation)
        self.length, self.thickness = length, thickness
        self.cells, self.law, self.youngs_modulus = cells, law, youngs_modulus
        X = self.full.nodes
        arm = np.unique(self.full.tets[: 6 * np.prod(cells)])
        self.root = np.flatnonzero(np.abs(X[:, 0]) < 1e-9 * length)
        self.end = arm[np.abs(X[arm, 0] - length) < 1e-9 * length]
        self.tip = int(self.end[np.linalg.norm(X[self.end] - [length, 0.0, 0.0], axis=1).argmin()])
        self.top = int(self.end[np.linalg.norm(X[self.end] - [length, 0.0, half], axis=1).argmin()])

    def swing(self, angle, step, duration, gravity=(0.0, 0.0, 0.0)):
        """Times [s], and the tip along and across the hinge's turning axes [m], [t, 2]."""
        return self.swing_with_slope(angle, step, duration, gravity)[:2]

    def swing_with_slope(self, angle, step, duration, gravity=(0.0, 0.0, 0.0)):
        """The same, and how far the end face is turned against the root [rad], [t]."""
        watched = [self.tip, self.top]
        t, x = self.full.swing(self.root, angle, [0.0, -1.0, 0.0], step, duration, watched, gravity)
        up = x[:, 1] - x[:, 0]
        return t, x[:, 0][:, [0, 2]], np.arctan2(-up[:, 0], up[:, 2])

    def pushed(self, force, steps=10):
        """How far the tip moves along and across, and its slope [rad], under a force [N] across the end; at rest."""
        loads = np.zeros_like(self.full.nodes)
        loads[self.end, 2] = force / len(self.end)
        x = self.full.statics(self.root, loads, steps)
        up = x[self.top] - x[self.tip]
        moved = x[self.tip] - self.full.nodes[self.tip]
        return moved[0], moved[2], float(np.arctan2(-up[0], up[2]))

    def frequencies(self, count):
        """Of the clamped arm at rest [Hz]."""
        from scipy.sparse.linalg import eigsh

        free = np.setdiff1d(np.arange(self.full.nodes.size), (3 * self.root[:, None] + np.arange(3)).ravel())
        K = self.full.forces(self.full.nodes)[1][free][:, free]
        values = eigsh(K, count, self.full.mass[free][:, free].tocsc(), sigma=0.0, return_eigenvectors=False)
        return np.sqrt(np.sort(values)) / (2.0 * np.pi)
