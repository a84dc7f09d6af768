"""`import calmotion`: it is quick, it offers what it says, and only what is used is imported."""

import importlib
import subprocess
import sys

import calmotion


def test_every_name_is_there():
    assert set(calmotion.__all__) == set(dir(calmotion))
    for name in calmotion.__all__:
        assert getattr(calmotion, name) is not None


def test_every_name_is_documented():
    for name in set(calmotion.__all__) - {"__version__"}:
        assert getattr(calmotion, name).__doc__


def test_the_lazy_names_are_those_for_type_checkers():
    homes = {name: f"calmotion.{module}" for module, names in calmotion._HOMES.items() for name in names}
    assert set(homes) == set(calmotion.__all__) - {"ShotError", "__version__"}
    for name, module in homes.items():
        assert getattr(importlib.import_module(module), name) is getattr(calmotion, name)


def test_importing_loads_nothing_heavy():
    code = (
        "import sys, calmotion;"
        "heavy = {'numpy', 'pxr', 'rerun', 'numba', 'scipy', 'calmotion.host', 'calmotion.model'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert printed.stdout.strip() == "[]"
