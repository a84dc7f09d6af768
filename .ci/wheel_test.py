"""Installs a wheel and what it asks for into a new environment and runs the demo in an empty folder, as a user would.

`wheel_test.py WHEEL SAMPLE` (`make wheel`): the kernels that the wheel carries must do, so nothing may be compiled. A
folder with one wheel does as well.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

# Told to numba before the command runs: each compilation is a line on standard error.
COUNTING = """
import sys
import calmotion.support.compilation  # before numba, whose options it sets
from numba.core import event

class Compilations(event.Listener):
    def on_start(self, happened):
        print("compiled", happened.data["dispatcher"].py_func.__qualname__, file=sys.stderr)

    def on_end(self, happened):
        pass

event.register("numba:compile", Compilations())
from calmotion.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def run(*command: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder without what would let it see the checkout or caches of the user."""
    hidden = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "CALMOTION_PLUGINS", "CALMOTION_WHEEL_KERNELS")
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    environment["CALMOTION_CACHE"] = str(folder / "cache")
    done = subprocess.run(list(map(str, command)), cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"error: {' '.join(map(str, command))}\n{done.stdout}\n{done.stderr}")
    return done


def test(wheel: Path, sample: Path) -> None:
    """Install, run, compare.

    Raises:
        SystemExit: A command fails, something is compiled, or the shake does not become less.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        venv.create(folder / "environment", with_pip=True)
        commands = folder / "environment" / ("Scripts" if os.name == "nt" else "bin")
        python = commands / "python"
        run(python, "-m", "pip", "install", "--quiet", wheel, folder=folder)
        run(commands / "calmotion", "--version", folder=folder)
        shutil.copytree(sample, folder / sample.name)
        (folder / "count.py").write_text(COUNTING)
        shot = Path(sample.name) / f"{sample.name}.usda"
        done = run(python, "count.py", "optimize", shot, "-o", "calm.usda", "--json", folder=folder)
        if compiled := [line for line in done.stderr.splitlines() if line.startswith("compiled")]:
            sys.exit(f"error: the wheel lacks {len(compiled)} kernels:\n" + "\n".join(compiled))
        report = json.loads(done.stdout)
        worst = max(report["targets"], key=lambda target: target["max_error_before_m"])
        before, after = (1e3 * worst[f"max_error_{when}_m"] for when in ("before", "after"))
        if not (folder / report["layer"]).is_file() or after > 0.2 * before:
            sys.exit(f"error: {worst['path']}: {before:.2f} mm before, {after:.2f} mm after")
    print(f"{wheel.name}: compiles nothing; largest error {before:.1f} mm before, {after:.2f} mm after")


if __name__ == "__main__":
    given = Path(sys.argv[1]).resolve()
    (built,) = given.glob("calmotion-*.whl") if given.is_dir() else [given]
    test(built, Path(sys.argv[2]).resolve())
