"""numba's compiler for kernels, without the work that kernels do not need.

A first search compiles some 180 kernels, and numba spends two thirds of that time in Python. Most of what can be left
out is here; what comes out computes the same:

- Python's garbage collector walks the whole heap again and again while numba makes its many small objects. It rests
  until the outermost kernel is compiled.
- numba tries every meaning of an operator anew for each place where it stands. For the same types the answer is the
  same, so it is kept.
- numba optimises each function four times, so that it can remove pairs of reference counts in between. Kernels count no
  references: they are optimised once, when all that they call is linked.
- numba looks for closures, overloads to inline and expressions of whole arrays, which kernels do not have.
- numba takes over new implementations of all its modules, also where there are none, whenever it does not find one.
- A kernel that is copied into another brings copies of its source locations, which never change.
- numba gives each function an entrance for Python, which takes its arguments out of objects. A kernel that other
  kernels call has none, and is compiled once more, for itself alone, if Python calls it after all.
"""

from __future__ import annotations

import contextlib
import gc
import threading
from collections.abc import Iterator
from typing import Any

from numba.core import ir
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.core.sigutils import normalize_signature
from numba.core.targetconfig import ConfigStack
from numba.core.typed_passes import InlineOverloads, NopythonRewrites
from numba.core.types.functions import BaseFunction
from numba.core.untyped_passes import InlineClosureLikes

from calmotion.support import interrupts

_BUILTIN = {"_operator", "builtins", "math"}  # modules of functions whose types depend on nothing but their arguments
_NOT_NEEDED = {InlineClosureLikes, InlineOverloads, NopythonRewrites}
_resolve = BaseFunction.get_call_type
_signatures: dict[Any, Any] = {}
_depth, _known = 0, -1
_thread = threading.local()  # one thread may compile while another calls


class KernelCompiler(Compiler):  # type: ignore[misc]
    """Compiles one kernel, and those that it calls."""

    def compile_extra(self, function: Any) -> Any:
        """Compile a Python function."""
        self.state.flags.no_cpython_wrapper = is_called_by_kernel()
        with _undisturbed(), called_by_kernel():
            return super().compile_extra(function)

    def define_pipelines(self) -> Any:
        """numba's passes; without those that only functions which make arrays need."""
        pipelines = super().define_pipelines()
        state = self.state
        if state.flags.nrt:
            return pipelines
        if state.library is None:
            state.library = _Library(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.enable_object_caching()
        for pipeline in pipelines:
            pipeline.passes = [entry for entry in pipeline.passes if entry[0] not in _NOT_NEEDED]
            pipeline.finalize()
        return pipelines


class _Library(JITCodeLibrary):  # type: ignore[misc]
    """The code of one kernel, optimised once."""

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


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


def with_entrance_for_python(dispatcher: Any) -> Any:
    """A function, compiled by numba, that is compiled with an entrance for Python when Python calls it."""
    compile_, add_overload = dispatcher.compile, dispatcher.add_overload
    without: set[Any] = set()

    def compile_for(signature: Any) -> Any:
        # numba and LLVM keep half of a kernel that is interrupted, and the process ends at its next use
        with global_compiler_lock, interrupts.deferred():
            arguments, _ = normalize_signature(signature)
            if arguments in without and not is_called_by_kernel():
                without.remove(arguments)
                del dispatcher.overloads[arguments]
            return compile_(signature)

    def add(result: Any) -> None:
        if is_called_by_kernel():
            arguments = tuple(result.signature.args)
            without.add(arguments)
            dispatcher.overloads[arguments] = result
        else:
            add_overload(result)

    dispatcher.compile, dispatcher.add_overload = compile_for, add
    return dispatcher


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """While the outermost kernel is compiled: without garbage collection, and with what was found before.

    numba compiles under a lock, so this is in one thread at a time.
    """
    global _depth
    collects, context = gc.isenabled(), cpu_target.target_context
    _depth += 1
    if _depth == 1:
        gc.disable()
        context.refresh = _refreshed
        BaseFunction.get_call_type = _remembered  # type: ignore[method-assign, assignment]
        ir.Loc.__deepcopy__ = lambda location, known: location
    try:
        yield
    finally:
        _depth -= 1
        if _depth == 0:
            del context.refresh, ir.Loc.__deepcopy__
            BaseFunction.get_call_type = _resolve  # type: ignore[method-assign]
            if collects:
                gc.enable()


def _refreshed() -> None:
    """Take over new implementations, if there are any."""
    global _known
    context = cpu_target.target_context
    registries = [*context._registries, *context.typing_context._registries]
    count = sum(len(entries) for registry in registries for entries in vars(registry).values() if type(entries) is list)
    if count != _known:
        type(context).refresh(context)
        _known = count


def _remembered(function: Any, context: Any, arguments: tuple[Any, ...], names: dict[str, Any]) -> Any:
    """The signature of a function for some types of arguments, found once."""
    if names or getattr(function.typing_key, "__module__", None) not in _BUILTIN:
        return _resolve(function, context, arguments, names)
    flags = ConfigStack.top_or_none()
    key = (function, id(context), tuple(arguments), bool(flags and flags.nrt))
    if key not in _signatures:
        _signatures[key] = _resolve(function, context, arguments, names)
    return _signatures[key]
