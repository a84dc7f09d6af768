"""What ever finer meshes tell about a body: one stiffness, and that of interfaces in each direction."""

import numpy as np
import pytest
from calmotion.reduction.full_order.mesh_extrapolation import Estimate, extrapolation, interface_factors, mode_ratios


def estimate(error, stiffness, nodes=1000):
    weights = np.array([0.75, 0.25])
    return Estimate(error, np.asarray(stiffness, dtype=float), weights, np.zeros(4), nodes)


def test_stiffness_is_extrapolated_by_its_change_and_by_the_estimated_error():
    exact, share = np.array([4.0, 9.0]), 0.6
    meshes = [estimate(error, exact * (1.0 + share * error)) for error in (0.04, 0.02, 0.01)]
    found, left = extrapolation(meshes)
    assert found == pytest.approx(np.sqrt(share * 0.55) * 0.01, rel=0.02) and left == pytest.approx(
        0.2 * found, rel=0.1
    )
    found, left = extrapolation(meshes[1:])
    assert left == pytest.approx(0.5 * found, rel=0.01)  # one comparison alone
    assert extrapolation(meshes[:1]) == (0.0, 0.04)
    stiffer = estimate(0.005, exact * 1.02)  # than the coarser mesh, which refinement does not do
    assert extrapolation([meshes[2], stiffer]) == (0.0, 0.005)


def test_modes_that_are_not_those_of_the_coarser_mesh_are_not_compared():
    coarse, fine = estimate(0.02, [4.04, 9.09]), estimate(0.01, [4.02, 9.045])
    ratios, weights = mode_ratios(coarse, fine)
    assert ratios == pytest.approx([4.02 / 4.04, 9.045 / 9.09]) and weights == pytest.approx([0.75, 0.25])
    # loads choose another basis: a mode above, or one that the other mesh has left out, is in the place of the second
    for other in (9.9, 16.0, 6.0):
        found = estimate(0.01, [4.02, other])
        ratios, weights = mode_ratios(coarse, found)
        assert weights == pytest.approx([1.0, 0.0]) and weights @ ratios == pytest.approx(4.02 / 4.04)
        assert extrapolation([coarse, found])[0] == pytest.approx(extrapolation([coarse, fine])[0], rel=1e-3)
        assert mode_ratios(coarse, found, complete=True)[1] == pytest.approx([0.75, 0.25])
    # a mesh whose estimate was far too small
    assert mode_ratios(coarse, estimate(0.01, [3.2, 7.2]))[1] == pytest.approx([0.75, 0.25])
    strange = estimate(0.01, [6.0, 16.0])
    assert not mode_ratios(coarse, strange)[1].any() and extrapolation([coarse, strange]) == (0.0, 0.01)


def test_a_change_that_is_not_the_estimate_is_less_certain():
    meshes = [estimate(0.04, [4.12, 9.27]), estimate(0.02, [4.08, 9.18]), estimate(0.01, [4.068, 9.153])]
    found, left = extrapolation(meshes)
    assert found < 0.005 and 0.3 * found < left <= 0.01


def with_interfaces(error, stiffness, forms):
    none = np.zeros(0)
    wrenches, levers = np.array([1.0, 2.0]), np.array([1.0, 0.5])
    return Estimate(error, none, none, none, 1000, stiffness, forms, wrenches, levers)


def test_interfaces_are_extrapolated_in_each_direction_by_its_own_error():
    exact, T = np.diag([4.0, 9.0]), np.array([[1.0, 0.3], [-0.2, 1.0]])
    # the error of one direction falls by half where that of the other falls by a fifth, and neither is the common one
    along = [np.array([0.04, 0.05]), np.array([0.02, 0.04]), np.array([0.01, 0.032])]
    meshes = [
        with_interfaces(error, T.T @ (exact * (1.0 + 0.6 * own)) @ T, T.T @ (exact * own) @ T)
        for error, own in zip((0.04, 0.021, 0.011), along, strict=True)
    ]
    factors, softest, error = interface_factors(meshes[0], meshes)
    # the geometric mean of the change, six tenths of the estimate, and of half of it: almost what is there
    share, last = np.sqrt(0.6 * 0.5), along[2] / (1.0 + 0.6 * along[2])
    limit = T.T @ (exact * (1.0 + 0.6 * along[2]) * (1.0 - share * last)) @ T
    assert meshes[0].interfaces @ factors == pytest.approx(limit, rel=1e-9)
    assert meshes[0].interfaces @ factors == pytest.approx(T.T @ exact @ T, rel=5e-3)
    left = limit - meshes[0].interfaces @ softest
    assert np.linalg.eigvalsh(left).min() > 0.0
    # a fifth of what is extrapolated, in each direction; where one coarser mesh tells it, three tenths of the estimate
    shares = np.linalg.eigvals(np.linalg.solve(meshes[2].interfaces, left)).real
    assert sorted(shares) == pytest.approx(0.2 * share * last, rel=1e-6)
    assert min(shares) < error < max(shares)
    factors, softest, _ = interface_factors(meshes[2], meshes[1:])
    left = meshes[2].interfaces @ (factors - softest)
    assert sorted(np.linalg.eigvals(np.linalg.solve(meshes[2].interfaces, left)).real) == pytest.approx(0.3 * last)


def test_where_change_and_estimate_differ_more_is_left():
    stiffness = np.diag([4.0, 9.0])
    # both estimates fall by half; the change tells one and a half times the estimate, and a tenth of it
    told = np.array([1.5, 0.1])
    meshes = [
        with_interfaces(own, stiffness * (1.0 + told * own), own * stiffness * (1.0 + told * own))
        for own in (0.004, 0.002, 0.001)
    ]
    factors, softest, _ = interface_factors(meshes[2], meshes)
    excess = 1.0 - np.diag(factors)
    assert excess == pytest.approx([np.sqrt(1.5 * 0.5) * 1e-3, np.sqrt(0.1 * 0.5) * 1e-3], rel=0.01)
    assert np.diag(factors - softest) == pytest.approx([0.7e-3, 0.28e-3], rel=0.01)


@pytest.mark.parametrize("size, share, least", [(4e-3, 0.7, 0.1), (1e-3, 0.3, 0.05)], ids=["coarse", "fine"])
def test_what_the_change_before_told_otherwise_is_left_too(size, share, least):
    stiffness = np.diag([4.0, 9.0])
    for before, left in ((1.5, share), (0.5, least)):
        # the change of the finer two is half of the estimates, as usual
        excess = size * np.array([1.0 + 2.0 * before, 1.0, 0.5])
        meshes = [
            with_interfaces(own, stiffness * (1.0 + too_stiff), own * stiffness * (1.0 + too_stiff))
            for own, too_stiff in zip((4.0 * size, 2.0 * size, size), excess, strict=True)
        ]
        factors, softest, _ = interface_factors(meshes[2], meshes)
        assert np.diag(factors - softest) == pytest.approx(size * left * np.ones(2), rel=0.06)


def test_a_finer_mesh_that_is_not_softer_tells_nothing_of_its_interfaces():
    stiffness = np.diag([4.0, 9.0])
    stiffer = stiffness * np.array([1.01, 0.99])
    meshes = [with_interfaces(0.04, stiffness, 0.04 * stiffness), with_interfaces(0.02, stiffer, 0.02 * stiffer)]
    factors, softest, _ = interface_factors(meshes[1], meshes)
    assert factors[0, 0] == pytest.approx(1.0, abs=1e-12) and (factors - softest)[0, 0] == pytest.approx(0.02)
    assert factors[1, 1] < 0.995


def test_one_mesh_tells_its_own_error_and_a_body_without_interfaces_nothing():
    stiffness = np.diag([4.0, 9.0])
    mesh = with_interfaces(0.04, stiffness, 0.03 * stiffness)
    factors, softest, error = interface_factors(mesh, [mesh])
    assert factors == pytest.approx(np.eye(2)) and softest == pytest.approx(0.97 * np.eye(2))
    assert error == pytest.approx(0.03)
    assert interface_factors(estimate(0.04, [4.0, 9.0]), [estimate(0.04, [4.0, 9.0])]) is None


def ever_finer(found):
    """Estimates of meshes by their estimated errors of the first frequency [%] and that [Hz]."""
    none = np.zeros(0)
    return [Estimate(0.02 * e, np.array([f**2]), np.ones(1), none, 1000) for e, f in found]


@pytest.mark.parametrize(
    ("truth", "found"),
    [
        # the tip of a finger of the Shadow hand, which 50,000 nodes and more give some 638 Hz
        (638.0, [(18.35, 731.41), (13.76, 694.05), (9.87, 672.48), (6.81, 660.94), (4.65, 653.09)]),
        # the shoulder of the G1, a fork: its estimates fall more slowly than its errors
        (214.8, [(20.93, 251.81), (14.33, 237.6), (9.87, 227.18), (6.26, 220.94), (3.83, 218.18)]),
        # link7 of the Panda, where they fall as fast
        (857.5, [(13.06, 963.24), (9.48, 932.1), (7.13, 909.31), (5.38, 894.06), (4.04, 883.12)]),
    ],
)
def test_large_estimates_are_extrapolated_with_the_error_that_is_left(truth, found):
    lefts = []
    for count in range(2, len(found) + 1):
        excess, left = extrapolation(ever_finer(found[:count]))
        off = abs(found[count - 1][1] * np.sqrt(1.0 - excess) / truth - 1.0)
        assert off < 0.6 * left  # half of it is that of the frequency
        assert off < 0.5 * (found[count - 1][1] / truth - 1.0)
        lefts.append(left)
    assert lefts == sorted(lefts, reverse=True) and lefts[-1] < 0.03
    assert extrapolation(ever_finer(found[:1])) == (0.0, 0.02 * found[0][0])


def test_a_finer_mesh_that_is_not_softer_tells_nothing():
    assert extrapolation(ever_finer([(13.76, 694.05), (9.87, 672.48), (6.5, 690.0)])) == (0.0, 0.13)
    # and one whose estimate is hardly less is not compared
    assert extrapolation(ever_finer([(10.0, 700.0), (9.0, 690.0)])) == (0.0, pytest.approx(0.18))


def test_change_and_estimate_that_agree_leave_a_fifth():
    meshes = ever_finer([(e, 100.0 * np.sqrt(1.0 + 0.55 * 0.02 * e)) for e in (30.0, 20.0, 10.0)])
    excess, left = extrapolation(meshes)
    assert 1.0 / (1.0 - excess) == pytest.approx(1.0 + 0.55 * 0.2, abs=0.01)
    assert left == pytest.approx(0.2 * 0.55 * 0.2, rel=0.1)
    assert extrapolation(meshes[1:])[1] == pytest.approx(0.5 * 0.55 * 0.2, rel=0.1)  # one comparison alone


def test_modes_that_differ_are_less_certain():
    apart = [estimate(e, [100.0 * (1.0 + 4.0 / 3.0 * e), 400.0]) for e in (0.4, 0.3, 0.2)]  # in the mean e
    assert extrapolation(apart, one_factor=True)[1] > 2.0 * extrapolation(apart)[1]
    # one factor leaves each mode as far off as it is from the mean of all
    meshes = [estimate(e, [100.0 * (1.0 + 0.3 * e), 400.0 * (1.0 + 1.3 * e)]) for e in (0.16, 0.12, 0.08)]
    excess, left = extrapolation(meshes, one_factor=True)
    off = np.abs(meshes[-1].squares * (1.0 - excess) / [100.0, 400.0] - 1.0)
    assert 0.03 < off.max() < left < 2.0 * off.max()
