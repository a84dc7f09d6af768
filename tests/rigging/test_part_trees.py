"""Trees of parts from their motion."""

import numpy as np
import pytest
from calmotion.rigging.part_joints import BALL, FIXED, FREE, REVOLUTE
from calmotion.rigging.part_trees import WORLD, PartMotions, closed_chains, seat_parts
from scipy.spatial.transform import Rotation

N = 50
T = np.linspace(0.0, 2.0, N)
AXES = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 1, 0]], float)


def chain(root=None, angles=None):
    """World motions of links of 0.3 m, each turned by its hinge on the one before."""
    angles = 0.6 * np.sin(np.outer([2.0, 3.0, 2.5, 4.0], T) + np.arange(4)[:, None]) if angles is None else angles
    R, p = root or (np.tile(np.eye(3), (N, 1, 1)), np.zeros((N, 3)))
    Rs, ps = [], []
    for axis, angle in zip(AXES, angles, strict=True):
        R = R @ Rotation.from_rotvec(angle[:, None] * axis).as_matrix()
        Rs, ps = [*Rs, R], [*ps, p]
        p = p + R @ [0.05, 0.02, 0.3]
    return np.array(Rs), np.array(ps)


def seated(R, p, above=None, sizes=None):
    motions = PartMotions(R, p, 1e-3, 1e-8)
    count = len(R)
    return motions, seat_parts(motions, above or [WORLD] * count, sizes or [1.0] * count)


def test_parts_beside_each_other_are_seated_where_they_have_one_freedom():
    order = [2, 0, 3, 1]  # of the links, as a program may list them
    R, p = chain()
    _, seats = seated(R[order], p[order])
    carriers = {order[k]: order[s.carrier] if s.carrier != WORLD else WORLD for k, s in enumerate(seats)}
    assert carriers == {0: WORLD, 1: 0, 2: 1, 3: 2}
    assert all(seat.joint.kind == REVOLUTE for seat in seats)


def test_a_robot_that_moves_as_a_whole_has_one_root():
    turn = Rotation.from_euler("xyz", 0.3 * np.sin(np.outer(T, [1, 2, 3]))).as_matrix()
    R, p = chain((turn, np.sin(np.outer(T, [3.0, 1.0, 2.0]))))
    _, seats = seated(R, p)
    assert sorted(seat.joint.kind for seat in seats) == [FREE, REVOLUTE, REVOLUTE, REVOLUTE]
    assert [seat.carrier for seat in seats if seat.joint.kind == FREE] == [WORLD]


def test_the_scene_s_parents_are_kept_where_they_have_one_freedom():
    R, p = chain(angles=0.5 * np.sin(np.outer([2.0, 0.0, 0.0, 0.0], T)))  # all turn about the first hinge
    _, seats = seated(R, p, above=[WORLD, 0, 1, 2])
    assert [seat.carrier for seat in seats] == [WORLD, 0, 1, 2]
    assert [seat.joint.kind for seat in seats] == [REVOLUTE, FIXED, FIXED, FIXED]


def test_of_two_that_move_as_one_the_larger_is_the_carrier():
    R, p = chain()
    R, p = np.concatenate([R[1:2], R]), np.concatenate([p[1:2] + R[1] @ [0.1, 0.0, 0.0], p])
    _, seats = seated(R, p, sizes=[0.1, 0.5, 0.5, 0.5, 0.5])
    assert seats[0].carrier == 2 and seats[0].joint.kind == FIXED
    assert seats[3].carrier == 2


def test_a_ball_in_the_scene_stays_one():
    D = Rotation.from_euler("xyz", 0.4 * np.sin(np.outer(T, [2, 3, 4]))).as_matrix()
    motions, seats = seated(D[None], np.zeros((1, N, 3)))
    assert seats[0].joint.kind == BALL and motions.hinged(0, seats[0]).joint.axes.shape == (3, 3)


def four_bar():
    """Crank, coupler and rocker of a planar linkage: the pin of the rocker is that of the coupler, by circles."""
    crank = 2.0 * np.pi * T / T[-1]
    a, b, c, d = 0.1, 0.3, 0.25, 0.3
    tip = a * np.stack([np.cos(crank), np.sin(crank)], axis=1)
    away = np.array([d, 0.0]) - tip
    far = np.linalg.norm(away, axis=1)
    along = (b**2 - c**2 + far**2) / (2 * far)
    across = np.sqrt(b**2 - along**2)
    e = away / far[:, None]
    pin = tip + along[:, None] * e + across[:, None] * np.stack([-e[:, 1], e[:, 0]], axis=1)
    coupler = np.unwrap(np.arctan2(*(pin - tip).T[::-1]))
    rocker = np.unwrap(np.arctan2(*(pin - [d, 0.0]).T[::-1]))
    R = Rotation.from_rotvec(np.concatenate([crank, coupler, rocker])[:, None] * [0, 0, 1.0]).as_matrix()
    p = np.zeros((3, N, 3))
    p[1, :, :2], p[2, :, 0] = tip, d
    return R.reshape(3, N, 3, 3), p


def test_a_chain_that_the_tree_leaves_open_is_found():
    R, p = four_bar()
    motions, seats = seated(R, p, above=[WORLD, 0, WORLD])
    assert closed_chains(motions, seats) == [(1, 2)]
    R, p = chain()
    assert closed_chains(*seated(R, p)) == []


@pytest.mark.parametrize(("ratio", "pairs"), [(1.0, [(1, 2)]), (-2.0, [])])
def test_wheels_on_one_axle_are_told_where_they_turn_as_one(ratio, pairs):
    R, p = chain(angles=np.outer([1.0, 1.0, ratio, 1.0], T) * [[0], [1], [1], [0]])
    R[2] = R[0] @ Rotation.from_rotvec(ratio * T[:, None] * [0, 1.0, 0]).as_matrix()
    p[2] = p[1] + R[0] @ [0.0, 0.2, 0.0]
    motions, seats = seated(R[:3], p[:3], above=[WORLD, 0, 0])
    assert closed_chains(motions, seats) == pairs


def test_of_two_that_turn_as_one_in_the_world_one_carries_the_other():
    R, p = chain()
    R, p = np.concatenate([R[:1], R]), np.concatenate([p[:1] + R[0] @ [0.1, 0.0, 0.0], p])
    _, seats = seated(R, p, sizes=[0.1, 0.5, 0.5, 0.5, 0.5])
    assert seats[0].carrier == 1 and seats[0].joint.kind == FIXED
    assert [seat.carrier for seat in seats[1:]] == [WORLD, 1, 2, 3]
