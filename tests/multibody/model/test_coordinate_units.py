"""What changes of coordinates are compared with: a robot of other size and mass has the same decisions."""

import numpy as np
import pytest
from calmotion.multibody.integrators.newton import FLOOR, ROUNDING, largest_entry, rounding_floor, worst_component
from calmotion.multibody.model.system import allocate_state, coordinate_units
from particles import particle_system


@pytest.fixture
def system():
    return particle_system(np.random.default_rng(5), [-1, 0, 1], [2, 0, 3])[0]


def scaled(system, length, mass):
    """The system in other units of length and mass."""
    Z, m, position = mass * length**2 * system.Z, mass * system.mass, length * system.position
    unit = coordinate_units(m, Z, system.side, position, system.size - 6)
    return system._replace(mass=m, Z=Z, position=position, unit=unit)


def test_units_scale_with_the_robot(system):
    other = scaled(system, 1e-3, 1e-6)
    np.testing.assert_allclose(other.unit[:, :3], 1e-3 * system.unit[:, :3])
    np.testing.assert_array_equal(other.unit[:, 3:6], 1.0)
    np.testing.assert_allclose(other.unit[:, 6:], 1e-3 * 1e-3 * system.unit[:, 6:])


def test_the_size_of_a_correction_does_not_depend_on_units(system):
    x = np.random.default_rng(1).normal(size=system.unit.shape)
    other = scaled(system, 1e-3, 1e-6)
    same = x * other.unit / system.unit
    assert largest_entry(other, same) == pytest.approx(largest_entry(system, x), rel=1e-12)
    assert worst_component(other, same) == worst_component(system, x)


def test_a_robot_is_not_larger_for_being_far_from_the_origin(system):
    away = system.position.copy()
    away[system.side < 0] += 100.0
    moved = coordinate_units(system.mass, system.Z, system.side, away, system.size - 6)
    assert np.array_equal(moved, system.unit)
    state = allocate_state(system)
    assert rounding_floor(system, state) == FLOOR
    state.c[1, 2] = 1e4 * system.unit[0, 0]
    assert rounding_floor(system, state) == pytest.approx(1e4 * ROUNDING)


def test_a_robot_without_any_length_is_compared_with_a_metre():
    one = coordinate_units(np.ones(1), np.zeros((1, 3, 3)), np.array([[-1, 0]], np.int32), np.zeros((1, 2, 3)), 1)
    np.testing.assert_array_equal(one, 1.0)
