"""The tangent along many directions at once, against that along each alone."""

import numpy as np
import pytest
from calmotion.multibody.sensitivity.block_tangent import block_tangent, can_be_blocked
from calmotion.multibody.sensitivity.linearization import linearize
from calmotion.multibody.sensitivity.linearized_steps import bytes_of_an_instant
from calmotion.multibody.sensitivity.tangent import tangent
from sweep_cases import CASES, TIMES, Case, curves


@pytest.mark.parametrize("name", CASES)
def test_each_direction_is_that_of_a_single_sweep(name):
    case = Case(*CASES[name])
    trajectory, angles, rates = case.simulate(case.p)
    lin = linearize(case.system, trajectory, angles, rates, case.ws)
    assert can_be_blocked(lin)
    rng = np.random.default_rng(3)
    directions = [curves(case.dp * rng.normal(size=case.dp.shape)) for _ in range(5)]
    late = [(d * (TIMES > 0.1)[:, None], r * (TIMES > 0.1)[:, None]) for d, r in directions]
    component = np.array([0, 3, 3], np.int32)
    jacobian = rng.normal(size=(len(TIMES), 3, case.system.size))
    first = int(np.argmax(TIMES > 0.1))
    joints = np.arange(len(case.system.rows), dtype=np.int32)
    for chosen, begin in ((directions, 0), (late, first)):
        d_angle, d_rate = (np.stack([d[k][begin:] for d in chosen], axis=2) for k in (0, 1))
        found = block_tangent(lin, begin, d_angle, d_rate, component, jacobian, joints)
        found, efforts = found[:, :3], found[:, 3:]
        for q, direction in enumerate(chosen):
            moved, transmitted = tangent(lin, *direction, efforts=True)
            assert np.abs(efforts[..., q] - transmitted[begin:]).max() <= 1e-9 * np.abs(transmitted).max()
            moved = moved[:, component]
            expected = np.einsum("nra,nra->nr", jacobian, moved)[begin:]
            assert np.abs(found[..., q] - expected).max() < 1e-12 * np.abs(jacobian * moved).sum(axis=2).max()


def test_linearisations_in_windows_are_left_to_single_sweeps():
    case = Case(*CASES["driven"])
    trajectory, angles, rates = case.simulate(case.p)
    few = linearize(case.system, trajectory, angles, rates, case.ws, memory=7 * bytes_of_an_instant(case.system))
    assert not can_be_blocked(few)
