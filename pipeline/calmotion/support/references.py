"""The type that numba has for tuples by reference (`by_reference`): a pointer to the block of their members.

Members cannot change, as the class is a tuple, so loads are marked as invariant: LLVM need not repeat them after each
write to an array.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.types.containers import BaseNamedTuple
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

from calmotion.support.by_reference import on_each_class

_WORD = ir.IntType(64)


class Reference(types.Type):
    """The type of a tuple that is passed by reference: the name of its class, and names and types of its members."""

    def __init__(self, of: str, members: tuple[tuple[str, Any], ...]) -> None:
        self.members = members
        super().__init__(f"reference to {of}({', '.join(f'{name}: {kind}' for name, kind in members)})")


def _type_of(value: Any, context: Any) -> Reference:
    members = zip(value._fields, (typeof_impl(member, context) for member in value), strict=True)
    return Reference(f"{type(value).__module__}.{type(value).__qualname__}", tuple(members))


def _count(kind: Any) -> int:
    """Number of words of a member."""
    if isinstance(kind, types.Array):
        return 1 + 2 * int(kind.ndim)
    if isinstance(kind, BaseNamedTuple):
        return sum(map(_count, kind.types))
    return 1


on_each_class(lambda made: typeof_impl.register(made)(_type_of))


@cache
def _places(kind: Reference) -> dict[str, tuple[int, Any]]:
    """The first word and the type of each member, by name."""
    places, first = {}, 0
    for name, member in kind.members:
        places[name] = (first, member)
        first += _count(member)
    return places


@register_model(Reference)
class _Pointer(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Reference) -> None:
        super().__init__(manager, kind, _WORD.as_pointer())


@unbox(Reference)  # type: ignore[untyped-decorator]
def _unbox(kind: Reference, value: Any, c: Any) -> NativeValue:
    address = c.pyapi.object_getattr_string(value, "_address")
    number = c.pyapi.long_as_ulonglong(address)
    c.pyapi.decref(address)
    return NativeValue(c.builder.inttoptr(number, _WORD.as_pointer()), is_error=c.pyapi.c_api_error())


@infer_getattr
class _Members(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, kind: Reference, name: str) -> Any:
        return _places(kind)[name][1] if name in _places(kind) else None


@lower_getattr_generic(Reference)  # type: ignore[untyped-decorator]
def _member(context: Any, builder: Any, kind: Reference, pointer: Any, name: str) -> Any:
    first, member = _places(kind)[name]
    return _load(context, builder, member, pointer, first)


def _load(context: Any, builder: Any, kind: Any, pointer: Any, first: int) -> Any:
    """The value of a member whose words begin at the first one."""

    def word(n: int, of: Any = _WORD) -> Any:
        place = builder.gep(pointer, [ir.Constant(_WORD, first + n)])
        value = builder.load(builder.bitcast(place, of.as_pointer()))
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value

    if isinstance(kind, BaseNamedTuple):
        values, at = [], first
        for part in kind.types:
            values.append(_load(context, builder, part, pointer, at))
            at += _count(part)
        return context.make_tuple(builder, kind, values)
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder)
        n = kind.ndim
        context.populate_array(
            array,
            data=word(0, array.data.type),
            shape=cgutils.pack_array(builder, [word(1 + i) for i in range(n)], _WORD),
            strides=cgutils.pack_array(builder, [word(1 + n + i) for i in range(n)], _WORD),
            itemsize=context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype))),
            meminfo=None,
        )
        return array._getvalue()
    if isinstance(kind, Reference):
        return word(0, _WORD.as_pointer())
    if isinstance(kind, types.Boolean):
        return builder.trunc(word(0), ir.IntType(1))
    return word(0, context.get_value_type(kind))
