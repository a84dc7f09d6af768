"""Bodies as beams, against the formulas of text books."""

import numpy as np
import pytest
from calmotion.accuracy.deflection_bound.beam import beam_between, stub
from calmotion.geometry.solid import Solid, mass_of_solid
from solids import PLASTIC, box, joined, prism, tube

LENGTH, SIDE = 0.3, 0.02
BAR = box((LENGTH, SIDE, SIDE), (0.0, -SIDE / 2, -SIDE / 2))
START, END = np.zeros(3), np.array([LENGTH, 0.0, 0.0])


def beam(solid=BAR, start=START, end=END, wall=1.0):
    whole = Solid(*solid, mass_of_solid(*solid, PLASTIC.density))
    return beam_between(whole, PLASTIC, wall, np.array(start), np.array(end))


def test_a_square_bar_twists_as_in_theory():
    shear = PLASTIC.youngs_modulus / (2 * (1 + PLASTIC.poissons_ratio))
    # A^4 / (40 I_p) = 0.15 a^4, where 0.1406 a^4 is exact
    assert beam().turn.sum() == pytest.approx(LENGTH / (shear * 0.15 * SIDE**4))
    assert beam().shift.sum() == pytest.approx(LENGTH / (5 / 6 * shear * SIDE**2))


def test_pieces_make_up_the_mass_of_the_body():
    found, whole = beam(start=(0.1, 0.0, 0.0)), mass_of_solid(*BAR, PLASTIC.density)
    assert found.mass.sum() == pytest.approx(whole.mass)
    assert np.allclose(found.mass @ found.center, whole.mass * whole.center)
    assert found.mass @ (found.spread + ((found.center - whole.center) ** 2).sum(axis=1)) == pytest.approx(
        np.trace(whole.inertia) / 2
    )


def test_all_hangs_on_a_slice_but_what_is_between_it_and_the_root():
    found = beam(start=(0.1, 0.0, 0.0))
    hang = found.hang(np.array([[0.05, 0.0, 0.0], [0.2, 0.0, 0.0], [0.3, 0.0, 0.0]]))
    assert hang[:, [0, 2]].all() and np.array_equal(hang[:, 1], found.middle[:, 0] <= 0.2)


def test_a_narrow_slot_is_detected():
    neck = 0.002
    parts = [box((0.1, SIDE, SIDE), (0, -SIDE / 2, -SIDE / 2)), box((neck, 0.004, SIDE), (0.1, -0.002, -SIDE / 2))]
    parts.append(box((0.1, SIDE, SIDE), (0.1 + neck, -SIDE / 2, -SIDE / 2)))
    found = beam(joined(*parts), end=(0.2 + neck, 0.0, 0.0))
    own = np.abs(found.middle[:, 0] - 0.1 - neck / 2) < neck / 2
    assert found.turn[own].sum() >= neck / (PLASTIC.youngs_modulus * SIDE * 0.004**3 / 12)


def test_thin_walls_elsewhere_make_a_body_softer():
    # as bars of that thickness side by side
    plates = PLASTIC.youngs_modulus * SIDE**2 * (SIDE / 2) ** 2 / 12
    assert beam(wall=SIDE / 2).turn.sum() == pytest.approx(LENGTH / plates)


def test_a_slanted_body_is_no_stiffer_than_a_straight_one():
    aside = np.array([LENGTH, 0.2, 0.0])
    points = BAR[0] + np.outer(BAR[0][:, 0] / LENGTH, [0.0, 0.2, 0.0])  # sections move aside
    slanted = beam((points, BAR[1]))
    along = beam((points, BAR[1]), START, aside)
    assert slanted.turn.sum() >= beam().turn.sum() and along.turn.sum() >= beam().turn.sum()


def test_bodies_that_are_not_beams_are_refused():
    assert beam(tube((LENGTH, 0.04, 0.04), 0.003), (0.0, 0.02, 0.02), (LENGTH, 0.02, 0.02)) is None
    assert beam(box((LENGTH, 0.6, 0.02), (0.0, -0.3, -0.01))) is None
    assert beam(end=(0.6, 0.0, 0.0)) is None  # beyond the body
    assert beam(prism(24, 0.01, LENGTH)) is not None


def test_a_stub_gives_as_much_as_the_material_around_a_rigid_disc():
    a, E, nu = 0.01, PLASTIC.youngs_modulus, PLASTIC.poissons_ratio
    turn, shift = stub(PLASTIC, a, 0.0)
    assert 3 * (1 - nu**2) / (4 * E * a**3) <= turn < 3 / (E * a**3)
    assert (2 - nu) * (1 + nu) / (4 * E * a) <= shift < 2 / (E * a)
    assert stub(PLASTIC, a, 0.01)[0] > turn
