"""All that this package uses of numba's private interfaces; nothing else imports them.

With it a first run compiles in a fifth of the time (docs/decisions/0009-kernel-arguments.md, 0010-kernel-compiler.md).
`compilation` leaves all of it out for a version of numba that is not known. It has three parts:

- `Reference`: tuples by reference (`by_reference`), for numba a pointer to the block of their members.
- `KernelCompiler`: numba's compiler without the work that kernels do not need.
- `compiled`: what other kernels call is compiled once, and kept in verified files.
"""

import contextlib
import gc
import hashlib
import importlib
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import extending, njit, types
from numba.core import cgutils, imputils
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.core.targetconfig import ConfigStack
from numba.core.typed_passes import InlineOverloads, NopythonRewrites
from numba.core.types.functions import BaseFunction
from numba.core.typing.templates import AttributeTemplate
from numba.core.untyped_passes import InlineClosureLikes

from calmotion.support import interrupts
from calmotion.support.by_reference import on_each_class
from calmotion.support.kernel_cache import KernelCacheFile

_WITHOUT_ARRAYS: dict[str, Any] = {"_nrt": False, "no_cfunc_wrapper": True, "nogil": True}  # of its own making
_WORD = ir.IntType(64)
_BUILTIN = {"_operator", "builtins", "math"}  # modules of functions whose types depend on nothing but their arguments
_NOT_NEEDED = {InlineClosureLikes, InlineOverloads, NopythonRewrites}
_resolve = BaseFunction.get_call_type
_signatures: dict[Any, Any] = {}
_depth = 0
_thread = threading.local()  # one thread may compile while another calls


class Reference(types.Type):  # type: ignore[misc]
    """The type of a tuple that is passed by reference: the name of its class, and names and types of its members."""

    def __init__(self, of: str, members: tuple[tuple[str, Any], ...]) -> None:
        self.members = members
        super().__init__(f"reference to {of}({', '.join(f'{name}: {kind}' for name, kind in members)})")


def _type_of(value: Any, context: Any) -> Reference:
    members = zip(value._fields, (extending.typeof_impl(member, context) for member in value), strict=True)
    return Reference(f"{type(value).__module__}.{type(value).__qualname__}", tuple(members))


def _count(kind: Any) -> int:
    """Number of words of a member."""
    if isinstance(kind, types.Array):
        return 1 + 2 * int(kind.ndim)
    if isinstance(kind, types.BaseNamedTuple):
        return sum(map(_count, kind.types))
    return 1


on_each_class(lambda made: extending.typeof_impl.register(made)(_type_of))


@cache
def _places(kind: Reference) -> dict[str, tuple[int, Any]]:
    """The first word and the type of each member, by name."""
    places, first = {}, 0
    for name, member in kind.members:
        places[name] = (first, member)
        first += _count(member)
    return places


@extending.register_model(Reference)
class _Pointer(extending.models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Reference) -> None:
        super().__init__(manager, kind, _WORD.as_pointer())


@extending.unbox(Reference)  # type: ignore[untyped-decorator]
def _unbox(kind: Reference, value: Any, c: Any) -> extending.NativeValue:
    address = c.pyapi.object_getattr_string(value, "_address")
    number = c.pyapi.long_as_ulonglong(address)
    c.pyapi.decref(address)
    return extending.NativeValue(c.builder.inttoptr(number, _WORD.as_pointer()), is_error=c.pyapi.c_api_error())


@extending.infer_getattr
class _Members(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, kind: Reference, name: str) -> Any:
        return _places(kind)[name][1] if name in _places(kind) else None


@extending.lower_getattr_generic(Reference)  # type: ignore[untyped-decorator]
def _member(context: Any, builder: Any, kind: Reference, pointer: Any, name: str) -> Any:
    first, member = _places(kind)[name]
    return _load(context, builder, member, pointer, first)


def _load(context: Any, builder: Any, kind: Any, pointer: Any, first: int) -> Any:
    """The value of a member whose words begin at the first one.

    Members cannot change, so loads are marked as invariant: LLVM need not repeat them after each write to an array.
    """

    def word(n: int, of: Any = _WORD) -> Any:
        place = builder.gep(pointer, [ir.Constant(_WORD, first + n)])
        value = builder.load(builder.bitcast(place, of.as_pointer()))
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value

    if isinstance(kind, types.BaseNamedTuple):
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


class KernelCompiler(Compiler):  # type: ignore[misc]
    """Compiles one kernel, and those that it calls.

    numba spends two thirds of the time in Python. What comes out without these parts of it computes the same:

    - Python's garbage collector walks the whole heap again and again while numba makes its many small objects. It rests
      until the outermost kernel is compiled.
    - numba tries every meaning of an operator anew for each place where it stands. For the same types the answer is the
      same, so it is kept.
    - numba looks for closures, overloads to inline and expressions of whole arrays, which kernels do not have.
    - numba gives each function an entrance for Python, which takes its arguments out of objects. A kernel that other
      kernels call has none, and is compiled once more, for itself alone, if Python calls it after all.
    """

    def compile_extra(self, function: Any) -> Any:
        """Compile a Python function."""
        self.state.flags.no_cpython_wrapper = is_called_by_kernel()
        with _undisturbed(), called_by_kernel():
            return super().compile_extra(function)

    def define_pipelines(self) -> Any:
        """numba's passes; without those that only functions which make arrays need."""
        pipelines = super().define_pipelines()
        if not self.state.flags.nrt:
            for pipeline in pipelines:
                pipeline.passes = [entry for entry in pipeline.passes if entry[0] not in _NOT_NEEDED]
                pipeline.finalize()
        return pipelines


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """While the outermost kernel is compiled: without garbage collection, and with what was found before.

    numba compiles under a lock, so this is in one thread at a time.
    """
    global _depth
    collects = gc.isenabled()
    _depth += 1
    if _depth == 1:
        gc.disable()
        BaseFunction.get_call_type = _remembered  # type: ignore[method-assign, assignment]
    try:
        yield
    finally:
        _depth -= 1
        if _depth == 0:
            BaseFunction.get_call_type = _resolve  # type: ignore[method-assign]
            if collects:
                gc.enable()


def _remembered(function: Any, context: Any, arguments: tuple[Any, ...], names: dict[str, Any]) -> Any:
    """The signature of a function for some types of arguments, found once."""
    if names or getattr(function.typing_key, "__module__", None) not in _BUILTIN:
        return _resolve(function, context, arguments, names)
    flags = ConfigStack.top_or_none()
    key = (function, id(context), tuple(arguments), bool(flags and flags.nrt))
    if key not in _signatures:
        _signatures[key] = _resolve(function, context, arguments, names)
    return _signatures[key]


def is_called_by_kernel() -> bool:
    """Whether what is compiled or loaded now is called by other kernels, not by Python."""
    return getattr(_thread, "callers", 0) > 0


@contextlib.contextmanager
def called_by_kernel() -> Iterator[None]:
    """While kernels are compiled or loaded that other kernels call."""
    _thread.callers = getattr(_thread, "callers", 0) + 1
    try:
        yield
    finally:
        _thread.callers -= 1


Claim = Callable[..., contextlib.AbstractContextManager[object]]


def compiled(function: Callable[..., Any], options: dict[str, Any], one_copy: bool, arrays: bool, claim: Claim) -> Any:
    """A function that numba compiles when it is first called.

    Args:
        function: To compile.
        options: Of `numba.njit`.
        one_copy: Whether its callers share its machine code, see `_share`.
        arrays: Whether it makes arrays.
        claim: Gives, for its name and types, the context in which it is compiled, so that no other process does.
    """
    without = {} if arrays else _WITHOUT_ARRAYS
    dispatcher = njit(cache=True, pipeline_class=KernelCompiler, **options, **without)(function)
    stored = dispatcher._cache
    stored._cache_file = KernelCacheFile(
        Path(stored.cache_path), dispatcher.py_func.__module__, stored._impl.filename_base,
        stored._impl.locator.get_source_stamp(), dumps, is_called_by_kernel,
    )  # fmt: skip
    return with_entrance_for_python(
        dispatcher, one_copy, partial(claim, f"{function.__module__}.{function.__qualname__}")
    )


def with_entrance_for_python(dispatcher: Any, one_copy: bool = False, claim: Claim = contextlib.nullcontext) -> Any:
    """A function, compiled by numba, that is compiled with an entrance for Python when Python calls it.

    Args:
        dispatcher: From `numba.njit`.
        one_copy: As of `compiled`.
        claim: The same of its types alone.
    """
    compile_, add_overload = dispatcher.compile, dispatcher.add_overload
    without: set[Any] = set()

    def compile_for(signature: Any) -> Any:
        # numba and LLVM keep half of a kernel that is interrupted, and the process ends at its next use
        with global_compiler_lock, interrupts.deferred():
            arguments, _ = normalize_signature(signature)
            if arguments in without and not is_called_by_kernel():
                without.remove(arguments)
                del dispatcher.overloads[arguments]
            with claim(arguments):
                return compile_(signature)

    def add(result: Any) -> None:
        if one_copy:
            _share(dispatcher, result)
        # callers need what it needs to be loaded; numba passes it on only if it was compiled in this process
        result.library._reload_init.update(result.reload_init)
        if is_called_by_kernel():
            arguments = tuple(result.signature.args)
            without.add(arguments)
            dispatcher.overloads[arguments] = result
        else:
            add_overload(result)

    dispatcher.compile, dispatcher.add_overload = compile_for, add
    return dispatcher


@dataclass(frozen=True)
class _Address:
    """What a caller from the cache needs first: the address of a function for these types of arguments."""

    module: str
    name: str
    arguments: tuple[Any, ...]

    @property
    def symbol(self) -> str:
        digest = hashlib.sha256(str(self.arguments).encode()).hexdigest()[:16]
        return f"{self.module}.{self.name}.{digest}"

    def __call__(self) -> None:
        with called_by_kernel():
            getattr(importlib.import_module(self.module), self.name).compile(self.arguments)


def _share(dispatcher: Any, result: Any) -> None:
    """Let all callers of what numba has compiled call one address.

    Of a function that a compiled one calls, numba links a copy into the caller, and LLVM compiles it once more there.
    Here the caller names a symbol, a hash of the function's name and of the types of its arguments. It gets its address
    when the function is compiled or read from the cache; a caller that is read from the cache does that first (numba's
    `reload_init`).
    """
    address = _Address(dispatcher.py_func.__module__, dispatcher.py_func.__qualname__, tuple(result.signature.args))
    pointer = result.library.get_pointer_to_function(result.fndesc.mangled_name)
    llvmlite.binding.add_symbol(address.symbol, pointer)
    context = result.target_context
    call = _call(address, result.fndesc)
    context.remove_user_function(result.entry_point)
    context._defns[result.entry_point].append(call, call.signature)


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
