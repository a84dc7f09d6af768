"""Machine code that several kernels call at one address, instead of a copy in each of them.

Of a function that a compiled function calls, numba links a copy into the caller, and LLVM compiles it once more there.
The equations of one instant are called by the step, the linearisation, the statics and four more: eight times the
largest part of compiling. Here the caller only names a symbol. The symbol is a hash of the function's name and of the
types of its arguments, thus the same in every process, and gets its address when the function is compiled or read from
the cache. A caller that is read from the cache does that first (numba's `reload_init`).
"""

from __future__ import annotations

import hashlib
import importlib
from dataclasses import dataclass
from typing import Any

import llvmlite.binding
from numba.core import cgutils, imputils

from calmotion.support.kernel_compiler import called_by_kernel


@dataclass(frozen=True)
class _Address:
    """What a caller from the cache needs first: the address of a function for these types of arguments."""

    module: str
    name: str
    arguments: tuple[Any, ...]

    @property
    def symbol(self) -> str:
        types = hashlib.sha256(str(self.arguments).encode()).hexdigest()[:16]
        return f"{self.module}.{self.name}.{types}"

    def __call__(self) -> None:
        with called_by_kernel():
            getattr(importlib.import_module(self.module), self.name).compile(self.arguments)


def with_addresses(dispatcher: Any) -> Any:
    """A function, compiled by numba, that passes on to its callers what it needs to be loaded.

    numba does so only for what was compiled in this process, not for what was read from the cache.
    """
    add_overload = dispatcher.add_overload

    def add(result: Any) -> None:
        result.library._reload_init.update(result.reload_init)
        add_overload(result)

    dispatcher.add_overload = add
    return dispatcher


def shared(dispatcher: Any) -> Any:
    """A function of a module, compiled by numba, whose machine code all its callers share."""
    add_overload = dispatcher.add_overload

    def add(result: Any) -> None:
        address = _Address(dispatcher.py_func.__module__, dispatcher.py_func.__qualname__, tuple(result.signature.args))
        pointer = result.library.get_pointer_to_function(result.fndesc.mangled_name)
        llvmlite.binding.add_symbol(address.symbol, pointer)
        context = result.target_context
        call = _call(address, result.fndesc)
        context.remove_user_function(result.entry_point)
        context._defns[result.entry_point].append(call, call.signature)
        add_overload(result)

    dispatcher.add_overload = add
    return dispatcher


def _call(address: _Address, description: Any) -> Any:
    """What numba emits for a call: as for its own functions, but of a symbol, and without linking the library."""

    def call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        convention = context.call_conv
        context.active_code_library._reload_init.add(address)
        kind = convention.get_function_type(description.restype, description.argtypes)
        function = cgutils.get_or_insert_function(builder.module, kind, address.symbol)
        convention.decorate_function(function, description.args, description.argtypes, noalias=description.noalias)
        status, value = convention.call_function(
            builder, function, description.restype, description.argtypes, arguments
        )
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        value = imputils.fix_returning_optional(context, builder, signature, status, value)
        return imputils.impl_ret_new_ref(context, builder, description.restype, value)

    call.signature = description.argtypes  # type: ignore[attr-defined]
    call.libs = ()  # type: ignore[attr-defined]
    return call
