"""Conversion of Gf and Vt values to NumPy arrays and back.

Gf multiplies row vectors from the left; here a matrix maps column vectors, `x -> A x + t`, as everywhere else in
the engine. Quaternions are (w, x, y, z).
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Vt

from calmotion.arrays import Array, IntArray


def vector(value: Any) -> Array:
    """A Gf vector as float64, shape [n]."""
    return np.array([float(x) for x in value])


def quaternion(value: Any) -> Array:
    """A Gf quaternion as (w, x, y, z), shape [4], not normalised."""
    return np.array([float(value.GetReal()), *(float(x) for x in value.GetImaginary())])


def quaternions(value: Any) -> Array:
    """A Vt array of quaternions as (w, x, y, z), shape [n, 4]; empty for None."""
    if value is None or len(value) == 0:
        return np.zeros((0, 4))
    # Vt keeps the real part last
    return np.roll(np.array(value, dtype=np.float64).reshape(-1, 4), 1, axis=1)


def matrix(value: Any) -> Array:
    """A Gf.Matrix4d as the matrix that maps column vectors, shape [4, 4]."""
    return np.array(value, dtype=np.float64).T.copy()


def points(value: Any) -> Array:
    """A Vt array of points as float64, shape [n, 3]; empty for None."""
    if value is None:
        return np.zeros((0, 3))
    return np.array(value, dtype=np.float64).reshape(-1, 3)


def indices(value: Any, width: int | None = None) -> IntArray:
    """A Vt array of integers as int32, shape [n], or [n, width] for int2, int3, int4 arrays; empty for None."""
    shape = (-1,) if width is None else (-1, width)
    return (np.zeros(0, np.int32) if value is None else np.array(value, dtype=np.int32)).reshape(shape)


def to_matrix(value: Array) -> Gf.Matrix4d:
    """The Gf.Matrix4d of a matrix [4, 4] that maps column vectors."""
    return Gf.Matrix4d(np.ascontiguousarray(value.T).tolist())


def to_points(value: Array) -> Vt.Vec3fArray:
    """A Vt.Vec3fArray of points [n, 3]."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(value, dtype=np.float32))


def to_quaternion(value: Array) -> Gf.Quatf:
    """A Gf.Quatf of a quaternion (w, x, y, z), shape [4]."""
    return Gf.Quatf(float(value[0]), Gf.Vec3f(*(float(x) for x in value[1:])))


def to_quaternions(value: Array) -> Vt.QuatfArray:
    """A Vt.QuatfArray of quaternions (w, x, y, z), shape [n, 4]."""
    return Vt.QuatfArray.FromNumpy(np.ascontiguousarray(np.roll(value, -1, axis=1), dtype=np.float32))


def to_vectors(value: Array, kind: Sdf.ValueTypeName) -> Vt.Vec3fArray | Vt.Vec3hArray:
    """A Vt array of vectors [n, 3] as the value of an attribute of type Float3Array or Half3Array."""
    if kind == Sdf.ValueTypeNames.Half3Array:
        return Vt.Vec3hArray.FromNumpy(np.ascontiguousarray(value, dtype=np.float16))
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(value, dtype=np.float32))


def to_strings(values: Iterable[object]) -> Vt.StringArray:
    """A Vt.StringArray: a Python list in layer metadata writes a file that cannot be opened again."""
    return Vt.StringArray([str(v) for v in values])


def to_doubles(values: Iterable[float]) -> Vt.DoubleArray:
    """A Vt.DoubleArray; a Python list in layer metadata writes a file that cannot be opened again."""
    return Vt.DoubleArray([float(v) for v in values])
