"""Tuples that kernels take by reference: every kind of member arrives as it is, and changes of arrays are seen."""

from typing import NamedTuple

import numpy as np
import pytest
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import kernel


class Plain(NamedTuple):
    """A tuple by value inside one by reference."""

    array: np.ndarray
    number: int


@by_reference
class Inner(NamedTuple):
    """A tuple by reference inside another."""

    values: np.ndarray
    share: float


@by_reference
class Outer(NamedTuple):
    """All kinds of members."""

    numbers: np.ndarray
    inner: Inner
    plain: Plain
    flag: bool
    matrix: np.ndarray
    length: float
    empty: np.ndarray


@kernel
def _sum(inner: Inner) -> float:
    total = 0.0
    for value in inner.values:
        total += value
    return total * inner.share


@kernel
def _read(outer: Outer, row: int) -> float:
    total = _sum(outer.inner) + 10.0 * outer.plain.number + 100.0 * outer.plain.array[1, 0] + outer.length
    if outer.flag:
        total += 1000.0
    view = outer.matrix[row]
    for k in range(len(view)):
        total += 1e4 * view[k]
    return total + 1e6 * outer.numbers[-1] + 1e8 * outer.empty.shape[0]


@kernel
def _accumulate(outer: Outer, times: int) -> None:
    for _ in range(times):
        for i in range(outer.matrix.shape[0]):
            for k in range(outer.matrix.shape[1]):
                outer.matrix[i, k] += outer.numbers[i] * outer.length


def make(matrix, flag=True):
    numbers = np.arange(3, dtype=np.int32)
    return Outer(
        numbers, Inner(np.ones(4), 0.5), Plain(np.arange(6.0).reshape(3, 2), 7), flag, matrix, 0.25, np.zeros((0, 2))
    )


MATRICES = {
    "contiguous": lambda: np.arange(6.0).reshape(3, 2),
    "every second column": lambda: np.arange(12.0).reshape(3, 4)[:, ::2],
    "transposed": lambda: np.arange(6.0).reshape(2, 3).T,
    "backwards": lambda: np.arange(6.0).reshape(3, 2)[::-1],
}


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES)
@pytest.mark.parametrize("flag", [True, False])
def test_a_kernel_reads_every_member(matrix, flag):
    outer = make(matrix(), flag)
    expected = 2.0 + 70.0 + 200.0 + 0.25 + 1000.0 * flag + 1e4 * outer.matrix[1].sum() + 2e6
    assert _read(outer, 1) == expected


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES)
def test_a_kernel_writes_to_the_arrays(matrix):
    outer = make(matrix())
    expected = outer.matrix + 5 * 0.25 * np.arange(3)[:, None]
    _accumulate(outer, 5)
    np.testing.assert_allclose(outer.matrix, expected, rtol=1e-15)


def test_a_changed_copy_has_members_of_its_own():
    outer = make(np.zeros((3, 2)))
    before = _read(outer, 0)
    longer = outer._replace(length=1.25, inner=Inner(np.ones(8), 0.5))
    assert type(longer) is type(outer)
    assert _read(longer, 0) == before + 1.0 + 2.0 and _read(outer, 0) == before
