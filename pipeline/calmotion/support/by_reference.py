"""Classes of tuples that kernels take by reference, and the blocks of words that they are passed as.

numba passes a tuple by value. That of a system holds some 30 arrays, about 250 numbers, which every call of a kernel
copies and LLVM has to sort out again; it was most of the time that kernels took to compile. A class decorated with
`by_reference` is handed to kernels as the address of a block of 8-byte words, in which its members lie one after the
other:

    array            address of the data, shape, strides
    number           itself
    other tuple      its members; or the address of its block, where it is by reference as well

The block is written once, when an object first reaches a kernel. `references` tells numba of these classes; this module
does without numba, so that a shot without flexible bodies does as well.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

Class = TypeVar("Class", bound=type[Any])
_classes: list[type] = []
_listeners: list[Callable[[type], None]] = []


def by_reference(tuple_class: Class) -> Class:
    """A class of `typing.NamedTuple` whose objects kernels take by reference; kernels read it and do not make it."""
    names = {name: getattr(tuple_class, name) for name in ("__module__", "__qualname__", "__doc__")}
    block = cached_property(_block)
    block.__set_name__(tuple_class, "_block")
    address = cached_property(lambda value: value._block.ctypes.data)
    address.__set_name__(tuple_class, "_address")
    made = type(tuple_class.__name__, (tuple_class,), {**names, "_block": block, "_address": address})
    _classes.append(made)
    for listen in _listeners:
        listen(made)
    return made  # type: ignore[return-value]


def on_each_class(listen: Callable[[type], None]) -> None:
    """Call a function with each class that is by reference, now and whenever there is another."""
    _listeners.append(listen)
    for made in _classes:
        listen(made)


def _block(value: Any) -> np.ndarray[Any, np.dtype[np.uint64]]:
    """The words of a tuple's members."""
    return np.concatenate([_words(member) for member in value]).view(np.uint64)


def _words(member: Any) -> np.ndarray[Any, Any]:
    if isinstance(member, np.ndarray):
        return np.array([member.ctypes.data, *member.shape, *member.strides], np.int64).view(np.uint64)
    if hasattr(type(member), "_address"):
        return np.array([member._address], np.uint64)
    if isinstance(member, tuple):
        return _block(member)
    return np.array([member], np.float64 if isinstance(member, float) else np.int64).view(np.uint64)
