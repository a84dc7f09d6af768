"""A shared kernel is compiled once: its callers name a symbol, also where they are read from the cache."""

import os
import subprocess
import sys

import pytest

MODULE = """
import numpy as np
from calmotion.support.compilation import kernel, shared_kernel

@shared_kernel
def inner(x, n):
    if n > 3.0:
        raise ValueError("too many")
    total = 0.0
    for value in x:
        total += value ** n
    return total

@shared_kernel
def middle(x):
    return inner(x, 1.0) + inner(x, 2.0)

@kernel
def outer(x):
    return middle(x) + inner(x, 3.0)

@kernel
def linked(x):
    return inner(x, 2.0)

@kernel
def linking(x):
    return linked(x) + 1.0

@kernel
def failing(x):
    return inner(x, 4.0)
"""
SCRIPT = """
import numpy as np, module
x = np.array([1.0, 2.0, 3.0])
assert module.outer(x) == 56.0, module.outer(x)
try:
    module.failing(x)
except ValueError as error:
    assert str(error) == "too many"
else:
    raise AssertionError("the exception was lost")
for function in (module.outer, module.middle, module.inner):
    print(sum(function.stats.cache_hits.values()), sum(function.stats.cache_misses.values()))
if not sum(module.outer.stats.cache_hits.values()):
    code = next(iter(module.outer.inspect_llvm().values()))
    assert "define" in code and "module.inner." in code
    assert not any("inner" in line for line in code.splitlines() if line.startswith("define")), "a copy of it"
"""


@pytest.fixture
def run(tmp_path, repository):
    """Runs the script in a new process: hits and misses of the cache for the three functions."""
    (tmp_path / "module.py").write_text(MODULE)
    path = os.pathsep.join([str(repository / "pipeline"), str(tmp_path)])
    environment = os.environ | {"CALMOTION_CACHE": str(tmp_path / "cache"), "PYTHONPATH": path}
    environment.pop("NUMBA_CACHE_DIR", None)

    def run(script=SCRIPT):
        done = subprocess.run(
            [sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=600
        )
        assert done.returncode == 0, done.stderr
        return [tuple(map(int, line.split())) for line in done.stdout.splitlines()]

    return run


def test_callers_have_no_copy_and_are_found_in_the_cache(run):
    assert run() == [(0, 1), (0, 1), (0, 1)]
    outer, middle, inner = run()
    assert outer == (1, 0) and middle[1] == inner[1] == 0, "nothing is compiled again"
    assert middle[0] == inner[0] == 1, "the cached caller brings them"


@pytest.mark.parametrize("lost", ["inner", "middle"])
def test_a_lost_file_of_a_shared_kernel_is_compiled_again_for_a_cached_caller(run, tmp_path, lost):
    run()
    for path in (tmp_path / "cache").rglob(f"module.{lost}*.nbc"):
        path.unlink()
    hits = dict(zip(("outer", "middle", "inner"), run(), strict=True))
    assert hits.pop(lost) == (0, 1)
    assert all(misses == 0 for _, misses in hits.values())


def test_a_caller_of_a_cached_kernel_with_shared_ones_is_found_in_the_cache(run):
    call = "import numpy as np, module; assert module.{}(np.ones(3)) == {}"
    run(call.format("linked", 3.0))
    run(call.format("linking", 4.0))  # has a copy of the cached one, and with it the symbol
    run(call.format("linking", 4.0))


def test_kernels_that_kernels_call_get_an_entrance_for_python_when_it_calls_them(run):
    script = """
import numpy as np, module
x = np.array([1.0, 2.0, 3.0])
assert module.outer(x) == 56.0
assert module.middle(x) == 20.0 and module.inner(x, 2.0) == 14.0
assert module.linking(x) == 15.0 and module.linked(x) == 14.0 and module.outer(x) == 56.0
for function in (module.outer, module.middle, module.inner, module.linking, module.linked):
    print(sum(function.stats.cache_hits.values()), sum(function.stats.cache_misses.values()))
"""
    assert run(script) == [(0, 1), (0, 2), (0, 2), (0, 1), (0, 2)]
    assert all(misses == 0 for _, misses in run(script))
