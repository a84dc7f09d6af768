"""The key of compiled kernels covers all that ends up in machine code."""

from typing import ClassVar

import numba
import pytest
from calmotion.errors import ShotError
from calmotion.support import compilation, interrupts
from calmotion.support.compilation import kernel, kernel_key
from calmotion.support.numba_internals import with_entrance_for_python


@pytest.fixture
def package(tmp_path):
    """A package with one kernel, which imports a constant from a module without kernels."""
    root = tmp_path / "calmotion"
    (root / "support").mkdir(parents=True)
    (root / "support" / "compilation.py").write_text("OPTIONS = {'fastmath': True}\n")
    (root / "kernels.py").write_text("from calmotion.constants import G\n\n@kernel\ndef f(x):\n    return G * x\n")
    (root / "constants.py").write_text("G = 9.81\n")
    (root / "others.py").write_text("H = 1\n")
    return root


def test_the_key_changes_with_an_imported_constant_and_with_the_options(package):
    before = kernel_key(package)
    assert before == kernel_key(package)
    (package / "others.py").write_text("H = 2\n")
    assert before == kernel_key(package), "no kernel imports it"
    (package / "constants.py").write_text("G = 1.62\n")
    after = kernel_key(package)
    assert after != before
    (package / "support" / "compilation.py").write_text("OPTIONS = {'fastmath': False}\n")
    assert kernel_key(package) not in (before, after)


@pytest.mark.parametrize("module", ["numba", "llvmlite"])
def test_the_key_changes_with_the_compiler(package, monkeypatch, module):
    before = kernel_key(package)
    monkeypatch.setattr(getattr(compilation, module), "__version__", "0.0.0")
    assert kernel_key(package) != before


def test_where_numba_is_told_not_to_compile_the_variable_is_named(monkeypatch):
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    with pytest.raises(ShotError, match="NUMBA_DISABLE_JIT"):
        kernel(lambda x: x)


def test_an_interrupt_waits_until_a_kernel_is_loaded():
    done = []

    class Dispatcher:
        overloads: ClassVar = {}

        def compile(self, signature):
            interrupts.request()
            done.append(signature)

        def add_overload(self, result):
            pass

    dispatcher = with_entrance_for_python(Dispatcher())
    with pytest.raises(KeyboardInterrupt):
        dispatcher.compile((numba.float64,))
    interrupts.answer()
    assert done == [(numba.float64,)]
