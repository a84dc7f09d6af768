"""A beam that stands for a body without geometry."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh.sources import beam as beam_module
from calmotion.model import Frame, MassProperties
from mesher_links import link

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ROOT = Frame(np.zeros(3), IDENTITY)
DENSITY = 1200.0


def at(*position):
    return Frame(np.array(position, dtype=float), IDENTITY)


def bar(wide, high, length, turn=None):
    """Mass properties of a bar along x from the origin, its width along y."""
    mass = DENSITY * wide * high * length
    inertia = mass / 12.0 * np.diag([wide**2 + high**2, high**2 + length**2, wide**2 + length**2])
    turn = np.eye(3) if turn is None else turn
    return MassProperties(mass, turn @ [0.5 * length, 0.0, 0.0], turn @ inertia @ turn.T)


@pytest.fixture
def beam_of():
    return lambda mass, *frames: beam_module.equivalent_beam(replace(link(), mass=mass), frames)


def test_the_beam_of_a_bar_is_the_bar(beam_of):
    made = beam_of(bar(0.03, 0.012, 0.3), ROOT, at(0.3, 0, 0))
    assert made.volume == pytest.approx(0.03 * 0.012 * 0.3, rel=1e-6)
    assert np.ptp(made.points, axis=0) == pytest.approx([0.3, 0.03, 0.012], rel=1e-6)
    assert made.source == "equivalent beam" and "30 x 12 mm" in made.repairs[0]


def test_the_beam_turns_with_the_bar(beam_of):
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    made = beam_of(bar(0.03, 0.012, 0.3, turn), ROOT, at(*(turn @ [0.3, 0, 0])))
    assert np.ptp(made.points @ turn, axis=0) == pytest.approx([0.3, 0.03, 0.012], rel=1e-6)


def test_a_round_bar_has_nearly_the_stiffness_of_its_square_beam(beam_of):
    radius, length = 0.01, 0.3
    mass = DENSITY * np.pi * radius**2 * length
    across = mass * (radius**2 / 4.0 + length**2 / 12.0)
    body = MassProperties(mass, np.array([0.15, 0, 0]), np.diag([mass * radius**2 / 2.0, across, across]))
    side = np.ptp(beam_of(body, ROOT, at(length, 0, 0)).points, axis=0)[1]
    # of the second moments of area, which the frequencies follow by the square root
    assert np.sqrt((side**4 / 12.0) / (np.pi * radius**4 / 4.0)) == pytest.approx(1.0, abs=0.05)


def test_a_leaf_reaches_twice_as_far_as_its_center_of_mass(beam_of):
    made = beam_of(bar(0.02, 0.02, 0.2), ROOT)
    assert np.ptp(made.points, axis=0)[0] == pytest.approx(0.2) and made.points[:, 0].min() == pytest.approx(0.0)


def test_a_branched_body_has_a_bar_to_each_joint(beam_of):
    made = beam_of(bar(0.02, 0.02, 0.2), ROOT, at(0.2, 0, 0), at(0, 0.2, 0))
    assert np.ptp(made.points, axis=0)[:2].min() > 0.2 and "2 beams" in made.repairs[0]


def test_without_mass_or_length_there_is_no_beam(beam_of):
    with pytest.raises(ShotError, match="no mass") as caught:
        beam_of(None, ROOT)
    assert "physics:mass" in caught.value.remedy
    with pytest.raises(ShotError, match="no joint"):
        beam_of(bar(0.02, 0.02, 0.2))
    for rounding in (0.0, 1e-17, 1e-216):
        ball = MassProperties(1.0, np.full(3, rounding), np.eye(3))
        with pytest.raises(ShotError, match="in one place"):
            beam_of(ball, ROOT)


def test_a_heavy_tip_makes_the_bar_wider_there(beam_of):
    straight = bar(0.03, 0.012, 0.3)
    heavy = replace(straight, center=np.array([0.17, 0.0, 0.0]))
    made = beam_of(heavy, ROOT, at(0.3, 0, 0))
    tip, root = (made.points[np.abs(made.points[:, 0] - x) < 1e-9] for x in (0.3, 0.0))
    assert np.ptp(tip[:, 1]) > 1.2 * np.ptp(root[:, 1])
    triangles = made.points[made.triangles]
    volume = np.einsum("ij,ij->i", np.cross(triangles[:, 0], triangles[:, 1]), triangles[:, 2]) / 6.0
    center = (volume[:, None] * triangles.sum(axis=1) / 4.0).sum(axis=0) / volume.sum()
    assert center == pytest.approx([0.17, 0.0, 0.0], abs=2e-3)
