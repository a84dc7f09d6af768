"""`import calmotion`: it is quick, it offers what it says, and only what is used is imported."""

import importlib
import subprocess
import sys
from pathlib import Path

import calmotion
import pytest
from calmotion.public_names import homes


def test_every_name_is_there():
    assert set(calmotion.__all__) == set(dir(calmotion))
    for name in calmotion.__all__:
        assert getattr(calmotion, name) is not None


def test_every_name_is_documented():
    for name in set(calmotion.__all__) - {"__version__"}:
        assert getattr(calmotion, name).__doc__


PACKAGE = Path(calmotion.__file__).parent
FRONTS = sorted(".".join(stub.relative_to(PACKAGE.parent).parent.parts) for stub in PACKAGE.rglob("__init__.pyi"))


@pytest.mark.parametrize("package", FRONTS)
def test_every_public_name_of_a_package_is_that_of_its_stub(package):
    front = importlib.import_module(package)
    for name, module in homes(package).items():
        defined = getattr(importlib.import_module(module), name)
        assert getattr(front, name) is defined
    assert set(dir(front)) == set(front.__all__) == set(homes(package))
    with pytest.raises(AttributeError, match="no attribute 'nobody'"):
        front.nobody  # noqa: B018


def test_importing_loads_nothing_heavy():
    code = (
        "import sys, calmotion;"
        "heavy = {'numpy', 'pxr', 'rerun', 'numba', 'scipy', 'calmotion.host', 'calmotion.model'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert printed.stdout.strip() == "[]"
