"""Joints found from motions that were made with known ones, and by other formulas."""

import numpy as np
import pytest
from calmotion.rigging.part_joints import BALL, FIXED, FREE, PRISMATIC, REVOLUTE, find_joint, with_hinges
from scipy.spatial.transform import Rotation

TOLERANCE = 1e-3
rng = np.random.default_rng(7)
N = 60
TIMES = np.linspace(0.0, 1.0, N)


def unit():
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def about(axis, point, angles):
    """Rotations about a line, of a part whose frame stands anywhere."""
    R0, p0 = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    D = Rotation.from_rotvec(angles[:, None] * axis).as_matrix()
    return D @ R0, point + D @ (p0 - point)


def find(R, p, rounding=1e-8):
    return find_joint(R, p, TOLERANCE, rounding)


def distance(point, line, axis):
    return np.linalg.norm(np.cross(point - line, axis))


def circle_center(p):
    """Center of the circle through three points, by their perpendicular bisectors."""
    a, b, c = p
    u, v = b - a, c - a
    n = np.cross(u, v)
    return a + (v @ v * np.cross(n, u) + u @ u * np.cross(v, n)) / (2.0 * n @ n)


@pytest.mark.parametrize("span", [0.05, 1.0, 3.5, 7.5])
def test_a_hinge_is_found_with_its_axis_point_and_angles(span):
    axis, point = unit(), rng.normal(size=3)
    angles = span * np.sin(2.0 * TIMES) ** 2
    R, p = about(axis, point, angles)
    joint = find(R, p)
    assert joint.kind == REVOLUTE
    sign = np.sign(joint.axes[0] @ axis)
    assert np.allclose(joint.axes[0] * sign, axis, atol=1e-9)
    assert distance(joint.point, point, axis) < 1e-9
    assert np.allclose(joint.values[:, 0] * sign, angles - angles[0], atol=1e-9)  # over more than a turn, too
    # independently: the eigenvector of a rotation, and the circle on which the origin goes
    k = int(np.argmin(np.abs(angles - angles[0] - min(span, 2.0) / 2.0)))
    values, vectors = np.linalg.eig(R[k] @ R[0].T)
    eigen = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    assert abs(eigen @ joint.axes[0]) == pytest.approx(1.0, abs=1e-9)
    assert distance(joint.point, circle_center(p[[0, k // 2, k]]), eigen) < 1e-6
    assert joint.gap.max() < 1e-9


def test_a_part_that_pauses_has_the_hinge_of_the_rest_of_its_motion():
    axis, point = unit(), rng.normal(size=3)
    angles = np.where(TIMES < 0.5, 0.0, 0.4 * (TIMES - 0.5))
    joint = find(*about(axis, point, angles))
    assert joint.kind == REVOLUTE and distance(joint.point, point, axis) < 1e-8


def test_a_slide_is_found_with_its_direction_and_lengths():
    axis, R = unit(), np.broadcast_to(Rotation.random(rng=rng).as_matrix(), (N, 3, 3))
    lengths = 0.02 * np.sin(5.0 * TIMES)
    joint = find(R, np.array([1.0, 2.0, 3.0]) + lengths[:, None] * axis)
    assert joint.kind == PRISMATIC and abs(joint.axes[0] @ axis) == pytest.approx(1.0)
    assert np.allclose(joint.values[:, 0] * np.sign(joint.axes[0] @ axis), lengths)


def test_what_moves_by_less_than_rounding_errors_is_fixed():
    R, p = about(unit(), np.zeros(3), 1e-7 * TIMES)
    assert find(R, p).kind == FIXED
    assert find(R.astype(np.float32).astype(float), p.astype(np.float32).astype(float), 6e-8).kind == FIXED


@pytest.mark.parametrize("count", [2, 3])
def test_rotations_about_a_point_need_two_or_three_hinges_through_it(count):
    point, p0 = rng.normal(size=3), rng.normal(size=3)
    euler = 0.5 * np.sin(np.outer(TIMES, [2.0, 3.0, 4.0]) + [0.0, 1.0, 2.0])
    euler[:, count:] = 0.0
    D = Rotation.from_euler("ZYX", euler).as_matrix()
    joint = find(D, point + D @ p0)
    assert joint.kind == BALL and np.allclose(joint.point, point, atol=1e-9)
    joint = with_hinges(joint, D, 1e-6)
    assert joint.axes.shape == (count, 3)
    R, p = joint.moved(D[0], point + D[0] @ p0)
    assert np.abs(R - D).max() < 1e-6 and np.abs(p - point - D @ p0).max() < 1e-6


def test_a_free_motion_is_told_with_what_it_is_off_a_hinge():
    R, p = about(np.array([0.0, 0.0, 1.0]), np.zeros(3), 0.5 * np.sin(6.0 * TIMES))
    joint = find(R, p + np.outer(np.sin(3.0 * TIMES), [0.0, 0.0, 0.012]))
    assert joint.kind == FREE
    assert 0.005 < joint.gap.max() < 0.012 and joint.tilt.max() < 1e-9


@pytest.mark.parametrize(("angle", "sure"), [(1e-5, False), (0.2, True)])
def test_a_hinge_that_hardly_turns_may_be_elsewhere(angle, sure):
    joint = find(*about(unit(), rng.normal(size=3), angle * TIMES))
    assert (joint.uncertainty(6e-8) < 1e-4) == sure


def test_the_point_of_a_noisy_hinge_is_as_sure_as_is_said():
    axis, point = unit(), rng.normal(size=3)
    R, p = about(axis, point, 0.05 * np.sin(9.0 * TIMES))
    joint = find(R, p + 1e-6 * rng.normal(size=p.shape))
    assert distance(joint.point, point, axis) < joint.uncertainty(1e-6)
