"""Compiles the kernels that simulating and optimising need, for a wheel: `wheel_kernels.py FOLDER` (`make wheel`)."""

import sys
import tempfile
from pathlib import Path

from calmotion.cli.main import main
from calmotion.support.caching.bundled_kernels import export
from calmotion.support.compilation import kernel_folder

SHOT = str(Path(__file__).parents[1] / "samples" / "bartender" / "bartender.usda")


def compile_and_export(target: Path) -> int:
    """Run both commands on a sample with one of everything that is common; the exit status."""
    with tempfile.TemporaryDirectory() as folder:
        layer = str(Path(folder) / "layer.usda")
        for arguments in (["simulate", SHOT], ["optimize", SHOT, "-o", layer]):
            if status := main(arguments):
                return status
    print(f"{export(kernel_folder(), target)} kernels")
    return 0


if __name__ == "__main__":
    sys.exit(compile_and_export(Path(sys.argv[1])))
