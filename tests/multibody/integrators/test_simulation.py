"""BDF2 on whole systems: published pendulum, order, joint gaps, conserved momentum, failures."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_poses, rigid_state, target_frames
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators import newton
from calmotion.multibody.integrators.coefficients import bdf2_integrator
from calmotion.multibody.integrators.simulation import simulate, simulate_from
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels import inertia
from calmotion.multibody.kernels.components import ComponentMotion
from calmotion.multibody.kernels.work import allocate_work
from calmotion.multibody.model.system import Instants, allocate_state
from particles import component_of, particle_system
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation


def pendulum_tip(h):
    """Tip at t = 10 s of a pendulum released level, started from two exact instants."""
    model = compiled(chain(1))
    system, ws, states = model.system, Workspace.for_system(model.system), []
    # the angle turns x towards -z
    exact = solve_ivp(lambda t, y: [y[1], 9.81 * np.cos(y[0])], (0, h), [0.0, 0.0], rtol=1e-13, atol=1e-14)
    for angle, rate in ((0.0, 0.0), exact.y[:, -1]):
        state = rigid_state(model, np.array([angle]))
        state.V[0, 4] = rate
        state.turn[0, 1] = angle
        states.append(state)
    zero = np.zeros(1)
    for _ in range(round(10.0 / h) - 1):
        now = allocate_state(system)
        code, *_ = newton.step(system, bdf2_integrator(h), Instants(*states[-2:], now), zero, zero, False, ws)
        assert code == newton.CONVERGED
        states.append(now)
    last = states[-1]
    return target_frames(model, last.c[None], last.q[None], last.u[None])[0][0, 0]


def test_pendulum_released_level_converges_at_second_order_to_the_published_position():
    """Pendulum of 1 m released level: (-0.27508746, -0.96141921) at t = 10 s; here to the other side."""
    errors = [np.linalg.norm(pendulum_tip(h)[[0, 2]] - [0.27508746, -0.96141921]) for h in (4e-3, 2e-3, 1e-3)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.1) and errors[-1] < 1e-4, (orders, errors)


def driven_arm(h):
    model = compiled(chain(3, driven=(0, 1, 2), length=0.3))
    times = np.arange(0.0, 1.0 + h / 2, h)
    motors = np.stack([np.sin(3 * times) ** 3, 1 - np.cos(4 * times), 0.5 * np.sin(5 * times) ** 3], axis=1)
    rates = np.stack(
        [
            9 * np.sin(3 * times) ** 2 * np.cos(3 * times),
            4 * np.sin(4 * times),
            7.5 * np.sin(5 * times) ** 2 * np.cos(5 * times),
        ],
        axis=1,
    )
    angles, d_angles = model.joint_angles(motors), model.joint_angles(rates)
    run = simulate(model.system, rigid_state(model, angles[0]), angles, d_angles, h, Workspace.for_system(model.system))
    c, q = rigid_poses(model, angles)
    exact = target_frames(model, c, q, np.zeros(c.shape[:2] + (0,)))[0]
    found = target_frames(model, run.states.c, run.states.q, run.states.u)[0]
    return np.abs(found - exact).max(), run


def test_driven_rigid_arm_follows_its_kinematics_with_closed_joints():
    (coarse, _), (fine, run) = driven_arm(1 / 240), driven_arm(1 / 480)
    assert np.log2(coarse / fine) > 1.9
    assert run.max_joint_gap < 1e-6
    assert np.abs(np.linalg.norm(run.states.q, axis=2) - 1.0).max() < 1e-14


class FreeBody:
    """A free flexible body without gravity, integrated independently with RK4 on its mass matrix."""

    def __init__(self, r=3):
        self.rng = np.random.default_rng(5)
        system, parts = particle_system(self.rng, [-1], [r], rows=[0], stiffness=400.0)
        self.system = system._replace(gravity=np.zeros(3), damping=np.zeros_like(system.damping))
        self.part, self.r = parts[0], r

    def rates(self, c, R, u, V):
        r, system = self.r, self.system
        work, component = allocate_work(system), component_of(system, 0)
        inertia.deformed_integrals(component, u, work)
        res, D, zero = np.zeros(6 + r), np.zeros((6 + r, 6 + r)), np.zeros(3)
        motion = ComponentMotion(zero, V[3:6], zero, u, V[6:], np.zeros(r))
        inertia.body_residual(component, motion, work, res)
        inertia.mass_matrix(component, work, D)
        a = np.linalg.solve(D, -res)
        return np.concatenate([R @ a[:3], a[3:]])

    def step(self, h, c, R, u, V):
        def f(state):
            c, R, u, V = state
            skew = np.cross(np.eye(3), V[3:6])  # [omega]x
            return V[:3], R @ skew, V[6:], self.rates(c, R, u, V)

        def add(state, k, t):
            return tuple(x + t * y for x, y in zip(state, k, strict=True))

        y = (c, R, u, V)
        k1 = f(y)
        k2 = f(add(y, k1, h / 2))
        k3 = f(add(y, k2, h / 2))
        k4 = f(add(y, k3, h))
        return tuple(a + h / 6 * (b + 2 * d + 2 * e + g) for a, b, d, e, g in zip(y, k1, k2, k3, k4, strict=True))

    def momenta(self, c, R, u, V):
        """Linear momentum, angular momentum about the world's origin, energy: sums over the particles."""
        y = self.part.points + self.part.modes @ u
        x = c + y @ R.T
        xd = V[:3] + (np.cross(V[3:6], y) + self.part.modes @ V[6:]) @ R.T
        m = self.part.masses[:, None]
        energy = 0.5 * np.sum(m * xd**2) + 0.5 * np.sum(self.system.stiffness[0, : self.r] * u**2)
        return np.concatenate([np.sum(m * xd, 0), np.sum(m * np.cross(x, xd), 0), [energy]])


def free_flight(h):
    """Largest drift of (momentum, angular momentum, energy) in BDF2, and of the RK4 that starts it."""
    body = FreeBody()
    rng = np.random.default_rng(6)
    V = np.concatenate([[0.3, -0.2, 0.5], [2.0, 1.0, -3.0], 0.5 * rng.normal(size=3)])
    y = (np.zeros(3), np.eye(3), 0.05 * rng.normal(size=3), V)
    states, fine, start = [allocate_state(body.system)], 20, y
    states[0].u[0], states[0].V[0] = y[2], V
    for _ in range(2):
        R0 = y[1]
        for _ in range(fine):
            y = body.step(h / fine, *y)
        s = allocate_state(body.system)
        s.c[0], s.u[0], s.V[0] = y[0], y[2], y[3]
        s.q[0] = np.roll(Rotation.from_matrix(y[1]).as_quat(), 1)
        s.turn[0] = (Rotation.from_matrix(R0).inv() * Rotation.from_matrix(y[1])).as_rotvec()
        states.append(s)
    ws = Workspace.for_system(body.system)
    before = body.momenta(*start)
    reference = np.abs(body.momenta(*y) - before).max()
    drift = np.zeros(7)
    zero = np.zeros(1)
    for _ in range(round(0.5 / h)):
        now = allocate_state(body.system)
        code, *_ = newton.step(body.system, bdf2_integrator(h), Instants(*states[-2:], now), zero, zero, False, ws)
        assert code == newton.CONVERGED
        states.append(now)
        R = Rotation.from_quat(np.roll(now.q[0], -1)).as_matrix()
        drift = np.maximum(drift, np.abs(body.momenta(now.c[0], R, now.u[0], now.V[0]) - before))
    return drift, reference


def test_free_flexible_body_keeps_momentum_and_energy_at_the_order_of_the_integrator():
    (coarse, exact), (fine, _) = free_flight(2e-3), free_flight(1e-3)
    assert exact < 1e-9, "the independent integration itself keeps them"
    orders = np.log2(coarse / fine)
    assert np.all(orders > 1.8), orders
    assert np.all(fine < 0.05)


def test_failure_names_time_and_component():
    model = compiled(chain(2, driven=(0, 1)))
    angles = np.zeros((5, 2))
    angles[3:, 1] = np.nan
    with pytest.raises(SimulationFailure) as error:
        simulate(
            model.system,
            rigid_state(model, np.zeros(2)),
            angles,
            angles * 0.0,
            0.01,
            Workspace.for_system(model.system),
        )
    assert error.value.time_s == pytest.approx(0.03) and error.value.component == 1


@pytest.mark.parametrize("first", [2, 3, 40])
def test_a_continued_simulation_equals_the_whole_one(first):
    model, h = compiled(chain(3, driven=(0, 1, 2), length=0.3)), 1 / 240
    system, ws = model.system, Workspace.for_system(model.system)
    times = h * np.arange(120)
    motors = np.stack([np.sin(3 * times), 1 - np.cos(4 * times), 0.5 * np.sin(5 * times)], axis=1)
    late = np.maximum(0.0, times - times[first - 1])[:, None]
    start = rigid_state(model, model.joint_angles(motors)[0])

    def whole(motors, workspace):
        curves = model.joint_angles(motors), model.joint_angles(np.gradient(motors, h, axis=0))
        # differences look ahead, and what comes before must not change
        curves[1][: first + 1] = model.joint_angles(np.ones((first + 1, 3)))
        return curves, simulate(system, start, *curves, h, workspace)

    _, known = whole(motors, ws)
    curves, expected = whole(motors + late**2, Workspace.for_system(system))
    found = simulate_from(system, known, first, *curves, ws)
    for part, one, other in zip(known.states._fields, found.states, expected.states, strict=True):
        assert np.array_equal(one, other), part
    assert np.array_equal(found.costs, expected.costs) and found.max_joint_gap == expected.max_joint_gap
    assert found.newton_iterations == expected.newton_iterations > known.newton_iterations // 2
    assert found.factorisations == expected.factorisations == expected.costs[:, 1].sum()
    assert found.wall_s > 0.0 and np.array_equal(known.states.c[:first], found.states.c[:first])
