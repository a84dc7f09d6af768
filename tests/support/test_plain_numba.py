"""Without private interfaces of numba kernels compute the same."""

import json
import os
import subprocess
import sys

import numba
import numpy as np
import pytest
from calmotion.support import compilation
from calmotion.support.compilation import PLAIN, cache_place, is_plain, kernel_key

ARM = """
import json, sys
import numpy as np
from scipy.sparse import diags
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.multibody import WORLD, Mechanism, natural_modes, simulate
from calmotion.multibody.analysis.kinematics import rigid_poses, target_frames

arm = Mechanism()
upper = arm.body("upper", 1.2, center=(0.25, 0, 0), inertia=(0.001, 0.03, 0.03))
fore = arm.body("fore", 0.8, center=(0.2, 0, 0), inertia=(0.001, 0.012, 0.012), position=(0.5, 0, 0))
shoulder = arm.joint("revolute", WORLD, upper, position=(0, 0, 0), axis=(0, -1, 0))
elbow = arm.joint("revolute", upper, fore, position=(0.5, 0, 0), axis=(0, -1, 0))
arm.motor(shoulder, model="drive", position_gain=900.0, velocity_gain=3.0)
arm.motor(elbow)
arm.target(fore, position=(0.9, 0, 0))
model = arm.compile()
times = np.arange(51) * 2e-3
values = np.array([0.5, 0.8]) * (1.0 - np.cos(2.0 * np.pi * times[:, None]))
"""
PART = """
origins, turns = rigid_poses(model, values)
places = target_frames(model, origins, turns, np.zeros((*origins.shape[:2], model.system.size)))
K = diags([-1.0, 4.0, -1.0], [-3, 0, 3], shape=(600, 600), format="csr")
found = [origins, turns, *places, SparseSolver(K).solve(np.cos(np.arange(600.0)))]
"""
WHOLE = """
rates = 2.0 * np.pi * np.array([0.5, 0.8]) * np.sin(2.0 * np.pi * times[:, None])
run = simulate(model, values, rates, step=2e-3)
found = [run.positions, run.rotations, run.efforts, natural_modes(model, np.zeros(2))[0]]
"""
RESULT = """
internals = "calmotion.support.numba_internals" in sys.modules
print(json.dumps([internals, [x.ravel().tolist() for x in found]]))
"""


@pytest.fixture
def results(repository):
    """Runs a script as it is and with the variable; the results."""

    def run(script):
        found = []
        for value in ("", "1"):
            environment = os.environ | {PLAIN: value, "PYTHONPATH": str(repository / "pipeline")}
            command = [sys.executable, "-c", ARM + script + RESULT]
            done = subprocess.run(command, env=environment, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
            internals, arrays = json.loads(done.stdout)
            assert internals == (value == "")
            found.append([np.array(array) for array in arrays])
        return zip(*found, strict=True)

    return run


def test_plain_kernels_compute_the_same(results):
    for usual, plain in results(PART):
        assert np.abs(plain - usual).max() <= 1e-12 * np.abs(usual).max()


@pytest.mark.long
def test_a_plain_simulation_is_the_same(results):
    for usual, plain in results(WHOLE):
        assert np.abs(plain - usual).max() <= 1e-12 * np.abs(usual).max()


VERSIONS = {"0.62.1": True, "0.63.1": False, "0.68.0rc1": False, "0.69.0": True, "1.0": True}


@pytest.mark.parametrize(("version", "plain"), VERSIONS.items())
def test_versions_that_are_not_known_are_used_plainly(monkeypatch, version, plain):
    monkeypatch.delenv(PLAIN, raising=False)
    monkeypatch.setattr(numba, "__version__", version)
    assert is_plain() is plain


def test_plain_kernels_have_a_key_of_their_own_and_a_folder_that_others_do_not_reach(monkeypatch, tmp_path):
    usual = kernel_key(compilation.PACKAGE)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv(PLAIN, "1")
    assert kernel_key(compilation.PACKAGE) != usual and cache_place() != tmp_path
    assert compilation._is_private(tmp_path / "new" / "folder")
    for mode, private in ((0o700, True), (0o755, False), (0o777, False)):
        tmp_path.chmod(mode)
        assert compilation._is_private(tmp_path) is private
    (tmp_path / "file").touch()
    assert not compilation._is_private(tmp_path / "file" / "folder")


def test_one_module_alone_uses_private_interfaces_of_numba(repository):
    sources = (repository / "pipeline").rglob("*.py")
    users = [path.stem for path in sources if "numba.core" in path.read_text() or "._nrt" in path.read_text()]
    assert set(users) <= {"compilation", "numba_internals"}  # the first listens to events, which numba documents
