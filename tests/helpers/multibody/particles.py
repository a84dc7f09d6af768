"""Systems made of particles, whose integrals are sums: an independent way to every term of the dynamics."""

from dataclasses import dataclass

import numpy as np
from calmotion.multibody.kernels import components as component_kernels
from calmotion.multibody.model.system import (
    LINEAR,
    NEOHOOKEAN,
    SERVO_COLUMNS,
    STVK,
    System,
    allocate_state,
    components,
    coordinate_units,
)
from scipy.spatial.transform import Rotation

POINTS = 4


@dataclass
class Particles:
    """Masses [n], points [n, 3] and mode displacements [n, 3, r] with a mass-orthonormal basis."""

    masses: np.ndarray
    points: np.ndarray
    modes: np.ndarray


def random_particles(rng, r: int, count: int = 12) -> Particles:
    masses = rng.uniform(0.1, 0.4, count)
    points = rng.normal(size=(count, 3)) * 0.3
    modes = rng.normal(size=(count, 3, r))
    if r:
        gram = np.einsum("n,nij,nik->jk", masses, modes, modes)
        modes = modes @ np.linalg.inv(np.linalg.cholesky(gram)).T
    return Particles(masses, points, modes)


def axial(T):
    """axial(y z^T) = y x z over the last two axes."""
    return np.stack([T[..., 1, 2] - T[..., 2, 1], T[..., 2, 0] - T[..., 0, 2], T[..., 0, 1] - T[..., 1, 0]], axis=-1)


def moments(part: Particles):
    """X x phi_j of each particle, shape [n, r, 3]."""
    return np.cross(part.points[:, None], part.modes.transpose(0, 2, 1))


def nonlinear(system, laws, rng, stiffness=50.0) -> System:
    """The system with random nonlinear elasticity: a law for each component, LINEAR keeps what it has.

    The quadratic strain of every second component sees a direction less than it has coordinates.
    """
    starts, arrays, points, size = [], [], [], 0
    lame = np.tile([0.3, 0.2], (len(laws), 1)) * stiffness
    for k, (law, r) in enumerate(zip(laws, system.elastic, strict=True)):
        data, count = np.zeros(0), 0
        if law == STVK:
            count = r - k % 2 if r > 1 else r
            strains = r + count * (count + 1) // 2
            fields = np.eye(strains, strains + 3) + 0.3 * rng.normal(size=(strains, strains + 3))
            data = stiffness * fields @ fields.T
            if count < r:
                data = np.concatenate([data.ravel(), rng.normal(size=count * r)])
        elif law == NEOHOOKEAN:
            gradients = 0.3 * rng.normal(size=(POINTS, 9 * r))
            weighted = np.hstack([rng.uniform(0.5, 1.5, (POINTS, 1)), gradients])
            data, count = np.concatenate([stiffness * np.eye(r).ravel(), weighted.ravel()]), POINTS
        points.append(count)
        starts.append(size)
        arrays.append(data.ravel())
        size += data.size
    law = np.array(laws, dtype=np.int32)
    kept = np.where(law[:, None] == LINEAR, 1.0, 0.0)
    return system._replace(
        law=law,
        stvk=components(law == STVK),
        neohookean=components(law == NEOHOOKEAN),
        stiffness=system.stiffness * kept,
        retardation=np.where(law == LINEAR, 0.0, 0.02),
        lame=lame,
        points=np.array(points, dtype=np.int64),
        data_start=np.array(starts, dtype=np.int64),
        data=np.concatenate(arrays),
    )


def component_of(system, b):
    """Component b of a system, as the kernels of one component take it."""
    return component_kernels.component_of.py_func(system, b)


def without_rotation(system, nonrotating) -> System:
    """The system, these components being told never to turn."""
    chosen = np.isin(np.arange(len(system.parent)), nonrotating)
    return system._replace(rotating=components(~chosen), nonrotating=components(chosen))


def particle_system(
    rng, parents, elastic, rows=None, stiffness=50.0, sliding=(), loops=(), moving=()
) -> tuple[System, list[Particles]]:
    """A random tree of components with random joint frames and modes.

    Args:
        sliding: Numbers of the joints that slide.
        loops: Further joints: (component on side 0 or -1, component on side 1, rows).
        moving: Joints whose marker of the world moves.
    """
    count, size = len(parents), max(elastic)
    parts = [random_particles(rng, r) for r in elastic]

    def pad(shape, values):
        out = np.zeros((count,) + shape)
        for b, value in enumerate(values):
            out[(b,) + tuple(slice(0, n) for n in value.shape)] = value
        return out

    S = [np.einsum("n,naj,nbk->jkab", p.masses, p.modes, p.modes) for p in parts]
    side = np.array([*((p, b) for b, p in enumerate(parents)), *((p, b) for p, b, _ in loops)], dtype=np.int32)
    joints = len(side)
    rows = [*(rows or [6] * count), *(r for _, _, r in loops)]
    Phi, Psi = np.zeros((joints, 2, 3, size)), np.zeros((joints, 2, 3, size))
    for j, pair in enumerate(side):
        for k, b in enumerate(pair):
            if b >= 0:
                Phi[j, k, :, : elastic[b]], Psi[j, k, :, : elastic[b]] = 0.3 * rng.normal(size=(2, 3, elastic[b]))
    mass, Z = (
        np.array([p.masses.sum() for p in parts]),
        np.array([np.einsum("n,na,nb->ab", p.masses, p.points, p.points) for p in parts]),
    )
    position = rng.normal(size=(joints, 2, 3)) * 0.2
    system = System(
        parent=np.array(parents, dtype=np.int32),
        elastic=np.array(elastic, dtype=np.int64),
        modes=np.array(elastic, dtype=np.int64),
        side=side,
        rows=np.array(rows, dtype=np.int32),
        servos=np.zeros(0, dtype=np.int32),
        rotor=np.full(joints, -1, dtype=np.int32),
        servo=np.zeros((joints, SERVO_COLUMNS)),
        sliding=np.isin(np.arange(joints), sliding).astype(np.int32),
        moving=np.array([moving.index(j) if j in moving else -1 for j in range(joints)], dtype=np.int32),
        switch=np.full(joints, -1, dtype=np.int32),
        contact=np.zeros(joints, dtype=np.int32),
        held=np.trace(Z, axis1=1, axis2=2),
        mass=mass,
        s=np.array([p.masses @ p.points for p in parts]),
        Z=Z,
        M3=pad((size, 3), [np.einsum("n,naj->ja", p.masses, p.modes) for p in parts]),
        M4=pad((size, 3, 3), [np.einsum("n,na,nbj->jab", p.masses, p.points, p.modes) for p in parts]),
        S=pad((size, size, 3, 3), S),
        axial=pad((size, size, 3), [axial(s) for s in S]),
        axial0=pad((size, 3), [np.einsum("n,nja->ja", p.masses, moments(p)) for p in parts]),
        rotating=np.arange(count, dtype=np.int32),
        nonrotating=np.zeros(0, dtype=np.int32),
        inertia=pad((size,), [np.ones(r) for r in elastic]),
        stiffness=pad((size,), [np.full(r, stiffness) * (1 + np.arange(r)) for r in elastic]),
        damping=pad((size, size), [0.35 * np.eye(r) + 0.05 for r in elastic]),
        law=np.zeros(count, dtype=np.int32),
        stvk=np.zeros(0, dtype=np.int32),
        neohookean=np.zeros(0, dtype=np.int32),
        retardation=np.zeros(count),
        lame=np.zeros((count, 2)),
        points=np.zeros(count, dtype=np.int64),
        data_start=np.zeros(count, dtype=np.int64),
        data=np.zeros(0),
        position=position,
        rotation=Rotation.random(2 * joints, random_state=7).as_matrix().reshape(joints, 2, 3, 3),
        Phi=Phi,
        Psi=Psi,
        gravity=np.array([0.3, -0.2, -9.81]),
        unit=coordinate_units(mass, Z, side, position, size),
    )
    return system, parts


def random_state(rng, system, spread=0.5):
    state = allocate_state(system)
    count = len(system.parent)
    state.c[:] = rng.normal(size=state.c.shape)
    state.q[:] = np.roll(Rotation.random(count, random_state=3).as_quat(), 1, axis=1)
    for b, r in enumerate(system.elastic):
        state.u[b, :r] = spread * rng.normal(size=r)
        state.V[b, : 6 + r] = rng.normal(size=6 + r)
    state.lam[:] = rng.normal(size=state.lam.shape)
    state.lam[np.arange(6) >= system.rows[:, None]] = 0.0
    return state


def by_particles(system, part, state):
    """Virtual work of all particles on (translation, rotation, modes), body axes."""
    a, om, al, u, v, vd = state
    y, yv, yvd = part.points + part.modes @ u, part.modes @ v, part.modes @ vd
    acceleration = a + np.cross(al, y) + np.cross(om, np.cross(om, y)) + 2 * np.cross(om, yv) + yvd
    force = part.masses[:, None] * acceleration
    r = len(u)
    elastic = np.einsum("nij,ni->j", part.modes, force) + system.stiffness[0, :r] * u + system.damping[0, :r, :r] @ v
    return np.concatenate([force.sum(0), np.cross(y, force).sum(0), elastic])
