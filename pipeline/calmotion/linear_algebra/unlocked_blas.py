"""Dense factors and products in place without the interpreter's lock, so that threads work on several at once.

SciPy's own wrappers of BLAS and LAPACK hold the lock while they work. The same functions are called here through the
pointers that SciPy gives to Cython programs; `ctypes` releases the lock around a call. All matrices are of float64 and
contiguous in Fortran order, and nothing is copied.
"""

from __future__ import annotations

from ctypes import CFUNCTYPE, byref, c_char, c_double, c_int, c_void_p
from functools import cache
from typing import Any

from calmotion.shot.character import Array

_LOWER, _UPPER, _RIGHT, _PLAIN, _TRANSPOSED = (byref(c_char(letter)) for letter in b"LURNT")
_Dense = Array  # float64, contiguous in Fortran order


@cache
def _function(module: str, name: str, arguments: int) -> Any:
    """A function of `scipy.linalg.cython_blas` or `scipy.linalg.cython_lapack`; all arguments are pointers."""
    from numba.extending import get_cython_function_address

    return CFUNCTYPE(None, *[c_void_p] * arguments)(get_cython_function_address(f"scipy.linalg.{module}", name))


def factor_cholesky(A: _Dense) -> bool:
    """Overwrite the lower triangle of A, shape [n, n], with its Cholesky factor; whether there is one.

    The upper triangle is left as it is. NaN is not reported.
    """
    _check(A)
    info = c_int(0)
    _function("cython_lapack", "dpotrf", 5)(_LOWER, _size(len(A)), A.ctypes.data, _stride(A), byref(info))
    return info.value == 0


def divide_right(B: _Dense, L: _Dense, transposed: bool) -> None:
    """B := B L^-1, or B L^-T; B of shape [m, n], L lower triangular, shape [n, n], its upper triangle not read."""
    _check(B)
    _check(L)
    if B.shape[1] != len(L) or L.shape[0] != L.shape[1]:
        raise ValueError(f"shapes {B.shape} and {L.shape} do not fit")
    if B.size:
        _function("cython_blas", "dtrsm", 11)(
            _RIGHT, _LOWER, _TRANSPOSED if transposed else _PLAIN, _PLAIN, _size(len(B)), _size(len(L)), _number(1.0),
            L.ctypes.data, _stride(L), B.ctypes.data, _stride(B),
        )  # fmt: skip


def add_gram(C: _Dense, A: _Dense, factor: float, lower: bool, of_columns: bool = False) -> None:
    """One triangle of C += factor A A^T, or factor A^T A of the columns; C of shape [m, m], A [m, k] or [k, m]."""
    _check(C)
    _check(A)
    m, k = A.shape[::-1] if of_columns else A.shape
    if C.shape != (m, m):
        raise ValueError(f"shapes {C.shape} and {A.shape} do not fit")
    if A.size:
        _function("cython_blas", "dsyrk", 10)(
            _LOWER if lower else _UPPER, _TRANSPOSED if of_columns else _PLAIN, _size(m), _size(k), _number(factor),
            A.ctypes.data, _stride(A), _number(1.0), C.ctypes.data, _stride(C),
        )  # fmt: skip


def _check(A: Array) -> None:
    # a wrong array would write over other memory
    if A.ndim != 2 or A.dtype.char != "d" or not A.flags.f_contiguous or not A.flags.writeable:
        raise ValueError("a matrix of float64 in Fortran order is needed")


def _size(n: int) -> Any:
    return byref(c_int(n))


def _stride(A: Array) -> Any:
    return byref(c_int(max(1, len(A))))


def _number(x: float) -> Any:
    return byref(c_double(x))
