"""Periodic motions: where a long simulation ends up, and derivatives against differences and their transpose."""

import numpy as np
import pytest
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.model.system import LINEAR, NEOHOOKEAN, STVK, State
from calmotion.multibody.sensitivity.linearization import linearize
from calmotion.multibody.sensitivity.linearized_steps import bytes_of_an_instant
from calmotion.multibody.sensitivity.periodic import (
    FREQUENCY,
    Monodromy,
    find_periodic_motion,
    periodic_adjoint,
    periodic_tangent,
)
from calmotion.multibody.sensitivity.perturbation import Perturbation, adjoint_from, end_difference, tangent_from
from sweep_cases import Case, rigid_start

STEPS, LENGTH = 60, 0.6
H = LENGTH / STEPS
RATE = 2.0 * np.pi / LENGTH
# instants 0 and 1 are the last two of the loop before
TIMES = H * (np.arange(STEPS + 2) - 1)

CASES = {
    "driven": ([6, 6, 6, 6], None),
    "bodies of large deflection": ([6, 6, 6, 6], [STVK, LINEAR, NEOHOOKEAN, LINEAR]),
    "sliders": ([6, 6, 6, 6], None, (0, 2, 3)),
    "a loop of joints": ([6, 5, 3, 5], None, (0,), ((2, 3, 3),)),
}


def curves(p, times=TIMES):
    """Harmonics of the loop, from coefficients of shape [4, J]."""
    w = RATE * np.array([0.0, 1.0, 1.0, 2.0])
    phase = np.outer(times, w) + np.array([0.0, 0.0, -np.pi / 2, 0.3])
    return np.cos(phase) @ p, (-w * np.sin(phase)) @ p


class Looping(Case):
    """The tree of `sweep_cases`, damped, over a loop."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.p[1:] *= 0.5
        system = self.system
        more = 0.5 * np.sqrt(3000.0) * np.eye(system.damping.shape[1])
        self.system = system._replace(damping=system.damping + more, retardation=system.retardation + 2e-3)
        self.monodromy = None
        self.start = self.warmed()
        rng = np.random.default_rng(5)
        shape = (len(TIMES), 4)
        self.wc, self.wq, self.wu = (rng.normal(size=shape + (k,)) for k in (3, 4, self.system.size - 6))
        for weights in (self.wc, self.wq, self.wu):
            weights[:2] = 0.0

    def warmed(self, loops=2):
        """The last two instants after some loops, the first of them from rest."""
        times = H * (np.arange(loops * STEPS + 1) - loops * STEPS)
        angles, rates = curves(self.p, times)
        s = np.clip((times - times[0]) / LENGTH, 0.0, 1.0)
        share, rise = s**3 * (10 - 15 * s + 6 * s * s), 30 * s**2 * (1 - s) ** 2 / LENGTH
        still = curves(self.p, times[:1])[0]
        rates = share[:, None] * rates + rise[:, None] * (angles - still)
        angles = still + share[:, None] * (angles - still)
        states = simulate(self.system, rigid_start(self.system, angles[0]), angles, rates, H, self.ws).states
        return tuple(State(*[part[n].copy() for part in states]) for n in (-2, -1))

    def loop(self, p):
        found, self.monodromy = find_periodic_motion(
            self.system, self.start, *curves(p), H, self.ws, None, self.monodromy
        )
        states = found.trajectory.states
        self.start = tuple(State(*[part[n].copy() for part in states]) for n in (0, 1))
        return found

    def value(self, p):
        states = self.loop(p).trajectory.states
        return float(np.sum(self.wc * states.c) + np.sum(self.wq * states.q) + np.sum(self.wu * states.u))


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES)
def looping(request):
    case = Looping(*request.param)
    found = case.loop(case.p)
    lin = linearize(case.system, found.trajectory, *curves(case.p), case.ws, begin=2)
    return case, found, lin, Monodromy.of(lin)


def test_the_cycle_closes_and_is_the_limit_of_a_long_simulation(looping):
    case, found, _, monodromy = looping
    assert found.distance < 1e-8
    apart = end_difference(case.system, found.trajectory.states)
    assert np.abs(apart.elastic).max() < 1e-7 and np.abs(apart.velocity).max() < 1e-5
    slowest = np.abs(np.linalg.eigvals(monodromy.B @ monodromy.Q)).max()
    if slowest > 0.9:
        assert np.any(case.system.rows < 6), "only free joints swing on and on"
        return
    later = case.warmed(40)[1]
    here = found.trajectory.states
    assert np.abs(later.c - here.c[1]).max() < 1e-6 and np.abs(later.u - here.u[1]).max() < 1e-5
    assert np.abs(case.warmed(2)[1].c - here.c[1]).max() > 1e-5, "two loops are not enough"


def test_sweeps_from_a_memory_are_transposes(looping):
    case, found, lin, _ = looping
    rng = np.random.default_rng(1)
    system, total = case.system, len(TIMES)
    length = len(Perturbation.of(system).vector)
    start, end = (Perturbation.of(system, rng.normal(size=length)) for _ in range(2))
    for memory in (start, end):
        for b, r in enumerate(system.elastic):
            memory.elastic[:, b, r:] = memory.velocity[:, b, 6 + r :] = 0.0
    gradient = rng.normal(size=(total, *found.trajectory.states.V.shape[1:]))
    gradient[:2] = 0.0
    d_angle, d_rate = rng.normal(size=(2, total, len(system.rows)))
    d_angle[:2] = d_rate[:2] = 0.0
    dX, _, moved = tangent_from(lin, start, d_angle, d_rate)
    g_angle, g_rate, pulled = adjoint_from(lin, gradient, end)
    forward = np.sum(dX * gradient) + moved.vector @ end.vector
    backward = np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate) + start.vector @ pulled.vector
    assert abs(forward - backward) < 1e-11 * (np.linalg.norm(moved.vector) * np.linalg.norm(end.vector))


def test_few_columns_contain_the_derivative_of_the_cycle(looping):
    case, _, lin, monodromy = looping
    zero = np.zeros((2, *lin.inputs.angles.shape))
    vector = np.random.default_rng(2).normal(size=monodromy.B.shape[1])
    start = Perturbation.of(case.system, vector).scaled(FREQUENCY)
    end = tangent_from(lin, start, *zero)[2].scaled(1.0 / FREQUENCY).vector
    assert np.abs(monodromy.Q @ (monodromy.B @ vector) - end).max() < 1e-9 * np.abs(end).max()
    assert len(monodromy.B) < 0.3 * len(vector)
    b = Perturbation.of(case.system, np.random.default_rng(3).normal(size=len(vector)))
    solved = monodromy.solve(b, case.system)
    back = tangent_from(lin, solved, *zero)[2]
    assert np.abs(solved.vector - back.vector - b.vector).max() < 1e-8 * np.abs(solved.vector).max()


def test_the_adjoint_is_the_transpose_of_the_tangent(looping):
    case, found, lin, monodromy = looping
    d_angle, d_rate = curves(case.dp)
    gradient = case.gradient(found.trajectory.states)
    forward = float(np.sum(periodic_tangent(lin, monodromy, d_angle, d_rate)[0] * gradient))
    g_angle, g_rate = periodic_adjoint(lin, monodromy, gradient)
    backward = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    assert abs(forward - backward) < 1e-11 * abs(forward)


def test_gradient_matches_central_differences_of_the_periodic_motion(looping):
    case, found, lin, monodromy = looping
    d_angle, d_rate = curves(case.dp)
    g_angle, g_rate = periodic_adjoint(lin, monodromy, case.gradient(found.trajectory.states))
    expected = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    e = 5e-4

    def difference(e):
        return (case.value(case.p + e * case.dp) - case.value(case.p - e * case.dp)) / (2 * e)

    measured = (4.0 * difference(e) - difference(2 * e)) / 3.0
    assert abs(measured - expected) < 1e-6 * abs(expected)


def test_windows_change_nothing(looping):
    case, found, lin, monodromy = looping
    gradient = case.gradient(found.trajectory.states)
    few = linearize(
        case.system, found.trajectory, *curves(case.p), case.ws, memory=7 * bytes_of_an_instant(case.system), begin=2
    )
    assert len(few.windows()) > 5 and few.windows()[0][0] == 2
    for one, other in zip(
        periodic_adjoint(few, monodromy, gradient), periodic_adjoint(lin, monodromy, gradient), strict=True
    ):
        assert np.array_equal(one, other)
