"""The linearised system against central differences of its residual (identity 5)."""

import dense
import numpy as np
import pytest
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.kernels.so3 import turn
from calmotion.multibody.kernels.work import allocate_work
from calmotion.multibody.model.system import Blocks, Integrator, State, allocate_blocks
from dense import condense, constrains, dense_matrix, join, split
from particles import particle_system, random_state
from scipy.spatial.transform import Rotation
from trees import TREES, put_world, tree


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize(
    "integrator", [Integrator(7.0, 5.0, 1.0, 3.0), Integrator(0.0, 0.0, 0.0, 1.0)], ids=["step", "statics"]
)
def test_blocks_are_the_derivative_of_the_residual(name, integrator):
    system = tree(name, 0)
    rng = np.random.default_rng(0)
    elastic = system.elastic
    count, size, joints = len(system.parent), system.size, len(system.rows)
    state = random_state(rng, system)
    Vd, Hv = np.zeros((count, size)), np.zeros((count, 4, 4))
    for b, r in enumerate(elastic):
        Vd[b, : 6 + r] = rng.normal(size=6 + r)
    Hv[:, 0, 0] = integrator.velocity
    Hv[:, 1:, 1:] = rng.normal(size=(count, 3, 3)) * (integrator.velocity > 0)
    angle, rate = rng.normal(size=(2, joints))
    work = allocate_work(system)
    put_world(work, rng)

    def evaluate(z, tangent=False, angle=angle, rate=rate):
        x, lam = split(system, z)
        moved = State(*[part.copy() for part in state])
        accelerated = Vd.copy()
        for b, r in enumerate(elastic):
            R = Rotation.from_quat(np.roll(state.q[b], -1)).as_matrix()
            moved.c[b] += R @ x[b, :3]
            turn(state.q[b], x[b, 3:6], moved.q[b])
            moved.u[b] += x[b, 6:]
            dV = np.concatenate(
                [integrator.velocity * R @ x[b, :3], Hv[b, 1:, 1:] @ x[b, 3:6], integrator.velocity * x[b, 6 : 6 + r]]
            )
            moved.V[b, : 6 + r] += dV
            accelerated[b, : 6 + r] += integrator.acceleration * dV
        moved.lam[:] += lam * constrains(system)
        blocks = allocate_blocks(system)
        assemble(system, integrator, moved, accelerated, angle, rate, Hv, tangent, work, blocks)
        blocks.gap[~constrains(system)] = 0.0
        return blocks

    def rows_of(blocks: Blocks):
        return join(system, blocks.res, blocks.gap)

    total = dense.size(system)
    A = condense(system, dense_matrix(system, evaluate(np.zeros(total), tangent=True)))
    e = 1e-5
    expected = np.stack([(rows_of(evaluate(d)) - rows_of(evaluate(-d))) / (2 * e) for d in e * np.eye(total)], axis=1)
    assert np.abs(A - expected).max() < 1e-8 * max(1.0, np.abs(expected).max())
    blocks = evaluate(np.zeros(total), tangent=True)
    for attribute, motor in (("by_angle", "angle"), ("by_rate", "rate")):
        for joint in np.flatnonzero(system.rows == 6):
            d = e * np.eye(joints)[joint]
            base = {"angle": angle, "rate": rate}
            plus = evaluate(np.zeros(total), **{motor: base[motor] + d})
            minus = evaluate(np.zeros(total), **{motor: base[motor] - d})
            by_motor = (plus.gap[joint] - minus.gap[joint]) / (2 * e)
            assert np.abs(getattr(blocks, attribute)[joint] - by_motor).max() < 1e-8
            on_bodies = (plus.res - minus.res) / (2 * e)
            p = system.side[joint, 0]
            if motor == "angle" and system.sliding[joint] and p >= 0:
                on_bodies[p] -= blocks.on_parent[joint]
            assert np.abs(on_bodies).max() < 1e-8


@pytest.mark.parametrize("free", [False, True], ids=["motor", "free slider"])
def test_multipliers_do_no_work_on_motions_that_the_constraints_allow(free):
    """The rows by the multipliers are minus the transpose of the constraints' velocity Jacobian."""
    rng = np.random.default_rng(1)
    system, _ = particle_system(rng, [-1, 0], [2, 3], [6, 5 if free else 6], sliding=[1] if free else [])
    state = random_state(rng, system)
    zero = np.zeros((2, system.size))
    blocks, Hv = allocate_blocks(system), np.zeros((2, 4, 4))
    args = (np.zeros(2), np.zeros(2), Hv)
    integrator = Integrator(0.0, 0.0, 1.0, 0.0)
    work = allocate_work(system)
    assemble(system, integrator, state, zero, *args, True, work, blocks)
    V = rng.normal(size=state.V.shape)
    rows = []
    for sign in (1.0, -1.0):
        moved = allocate_blocks(system)
        assemble(system, integrator, state._replace(V=state.V + sign * V), zero, *args, False, work, moved)
        rows.append(moved.gap)
    change = 0.5 * (rows[0] - rows[1])
    R = Rotation.from_quat(np.roll(state.q, -1, axis=1)).as_matrix()
    body = V.copy()
    body[:, :3] = np.einsum("bji,bj->bi", R, V[:, :3])
    expected = -np.einsum("bai,ba->bi", blocks.Lc, body)
    expected[1] -= blocks.Lp[1].T @ body[0]
    assert np.abs(change - expected)[constrains(system)].max() < 1e-12
