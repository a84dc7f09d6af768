"""A wheel in an empty environment does the main job, far from the checkout."""

import ast
import json
import os
import runpy
import shutil
import subprocess
import sys
import sysconfig
import textwrap
import tomllib
import venv
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


def run(*command: object, folder: Path) -> str:
    """As `run_process`; its stdout."""
    return run_process(*command, folder=folder).stdout


def run_process(*command: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder without what would let it see the checkout or earlier runs."""
    hidden = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "CALMOTION_PLUGINS")
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    environment["CALMOTION_CACHE"] = str(folder / "cache")
    done = subprocess.run(
        list(map(str, command)), cwd=folder, env=environment, capture_output=True, text=True, timeout=1800
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory, repository: Path) -> Path:
    """An environment that holds a wheel of this checkout and sees the dependencies that are installed here.

    They are not installed anew, which takes most of a minute; `test_every_import_is_declared` tests that the wheel asks
    for them. The checkout itself is not seen: only its environment's own files name it.
    """
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, repository, folder=folder)
    (wheel,) = folder.glob("calmotion-*.whl")
    return environment_with(wheel, folder)


def environment_with(wheel: Path, folder: Path) -> Path:
    """The Python of a new environment in a folder with a wheel, and with the dependencies that are installed here."""
    venv.create(folder / "environment", with_pip=False)
    python = folder / "environment" / "bin" / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", wheel, folder=folder)
    (packages,) = (folder / "environment").rglob("site-packages")
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


def test_a_wheel_in_an_empty_environment_holds_everything(installed: Path, repository: Path, tmp_path: Path):
    environment = installed.parents[1]
    code = "import calmotion, sys; print(calmotion.__file__); print(*sys.path, sep='\\n')"
    module, *path = run(installed, "-c", code, folder=tmp_path).splitlines()
    assert Path(module).is_relative_to(environment)
    assert [entry for entry in path if (Path(entry) / "calmotion").is_dir()] == [str(Path(module).parents[1])]

    command = environment / "bin" / "calmotion"
    plugins = json.loads(run(command, "plugins", "list", "--json", folder=tmp_path))["plugins"]
    assert {plugin["id"]: plugin["error"] for plugin in plugins} == {
        manifest.parent.name: None for manifest in (repository / "plugins").glob("*/plugin.toml")
    }
    assert all(Path(plugin["folder"]).is_relative_to(environment) for plugin in plugins)

    # every module can be imported there, the schemas are registered, and a shot is read
    code = """
        import pkgutil, importlib, calmotion
        for module in pkgutil.walk_packages(calmotion.__path__, "calmotion."):
            if not module.name.endswith(("__main__", "exudyn_arm", "tetwild_worker", "pytest_plugin")):
                importlib.import_module(module.name)
        from calmotion.usd.reading import read_shot
        character, animation, _ = read_shot("bartender/bartender.usda")
        print(len(character.motors), len(animation.frame_times), character.retarget.tolerance)
    """
    shutil.copytree(repository / "samples" / "bartender", tmp_path / "bartender")
    motors, frames, tolerance = run(installed, "-c", textwrap.dedent(code), folder=tmp_path).split()
    assert (int(motors), int(frames)) == (5, 97) and abs(float(tolerance) - 1e-3) < 1e-9


def imported(path: Path) -> set[str]:
    """Names of the packages that a module imports, at its top or in a function."""
    names = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            names.add(node.module.partition(".")[0])
    return names


def test_every_import_is_declared(repository: Path):
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    extras = [text for name, texts in project["optional-dependencies"].items() if name != "dev" for text in texts]
    declared = {canonicalize_name(Requirement(text).name) for text in [*project["dependencies"], *extras]}
    optional = {"bpy", "bpy_extras", "mathutils", "pytest", "pandas"}  # each where its users have it
    owners = {"bam": ["better-actuator-models"]} | packages_distributions()  # it needs Python 3.12
    modules = [path for room in ("pipeline", "plugins") for path in (repository / room).rglob("*.py")]
    assert len(modules) > 200
    for path in modules:
        for name in imported(path) - sys.stdlib_module_names - optional - {"calmotion", "calmotion_plugins"}:
            assert declared & {canonicalize_name(owner) for owner in owners.get(name, [name])}, f"{path}: {name}"


@pytest.mark.long
def test_a_platform_wheel_compiles_nothing(repository: Path, tmp_path: Path):
    shutil.copytree(repository / "samples" / "bartender", tmp_path / "bartender")
    kernels, python = os.environ.get("CALMOTION_WHEEL_KERNELS") or tmp_path / "kernels", sys.executable
    cpu = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": "+avx,+avx2,+bmi,+bmi2,+f16c,+fma,+lzcnt,+movbe"}
    building = (
        os.environ | cpu | {"CALMOTION_CACHE": str(tmp_path / "build"), "PYTHONPATH": str(repository / "pipeline")}
    )
    if not Path(kernels).is_dir():
        script = repository / ".ci" / "wheel_kernels.py"
        subprocess.run([python, script, kernels], env=building, check=True, capture_output=True, timeout=3000)
    building["CALMOTION_WHEEL_KERNELS"] = str(kernels)
    command = [python, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", tmp_path, repository]
    subprocess.run(command, env=building, check=True, capture_output=True, timeout=600)
    (wheel,) = tmp_path.glob("calmotion-*.whl")
    assert not wheel.name.endswith(("-none-any.whl", "-linux_x86_64.whl")), "a tag that package indexes refuse"
    installed = environment_with(wheel, tmp_path)
    for arguments in (
        ["optimize", "bartender/bartender.usda", "-o", "calm.usda", "--json"],
        ["simulate", "bartender/bartender.usda", "--json"],
    ):
        (tmp_path / "count.py").write_text(runpy.run_path(str(repository / ".ci" / "wheel_test.py"))["COUNTING"])
        done = run_process(installed, "count.py", *arguments, folder=tmp_path)
        assert [line for line in done.stderr.splitlines() if line.startswith("compiled")] == []
        assert "error" not in json.loads(done.stdout)


@pytest.mark.long
def test_a_wheel_in_an_empty_environment_optimises_a_shot(installed: Path, repository: Path, tmp_path: Path):
    command = installed.parents[1] / "bin" / "calmotion"
    shutil.copytree(repository / "samples" / "bartender", tmp_path / "bartender")
    printed = run(
        command,
        "optimize",
        "bartender/bartender.usda",
        "-o",
        "calm.usda",
        "--csv",
        "calm.csv",
        "--rrd",
        "calm.rrd",
        "--json",
        "--step",
        "10ms",
        "--set",
        "retarget.optimize.max_iterations=3",
        folder=tmp_path,
    )
    report = json.loads(printed)
    assert "error" not in report
    for name in ("layer", "root_layer", "csv", "rrd"):
        assert (tmp_path / report[name]).stat().st_size > 0
    asked_for = {"bartender", "cache", "calm.usda", "calm_root.usda", "calm.csv", "calm.rrd"}
    assert {path.name for path in tmp_path.iterdir()} == asked_for, "a run leaves only what was asked for"
    assert report["targets"] and report["modes"] > 0
    assert report["objective_after"] < report["objective_before"]
    for target in report["targets"]:
        assert target["max_error_after_m"] < target["max_error_before_m"]
