"""Scratch of the kernels: large enough for every law."""

import pytest
from calmotion.multibody.kernels.work import allocate_law_work


@pytest.mark.parametrize("p", [0, 1, 3])
def test_a_body_whose_quadratic_strain_has_no_directions_has_room_for_its_coordinates(p):
    """`stvk` writes r + p (p + 1) / 2 strain coordinates and as many stresses, also where p is 0."""
    size = 2 + p * (p + 1) // 2
    work = allocate_law_work(2, p, False)
    assert work.strain.shape == (2 * size,) and work.rows.shape[1] >= size and work.inner.shape == (p, 2)


def test_without_a_body_of_that_law_there_is_none():
    assert allocate_law_work(2, -1, False).strain.size == 0
