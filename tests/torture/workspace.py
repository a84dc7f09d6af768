"""The folder of a campaign: a tiny shot, warm caches with a copy, the outputs, and the result of an undisturbed run."""

import os
import random
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
OUTPUTS = ("calm.usda", "calm_root.usda", "calm.csv", "calm.rrd")
FIGURES = ("convergence.png", "errors.png", "filmstrip.png", "motors.png", "spectra.png")
OPTIONS = ("--tolerance", "1mm", "--set", "fe.mesh.element_size=40mm", "--json", "--progress")
CHECKPOINT = ".calm.usda.checkpoint.npz"

# One flexible link of soft nylon: 31 nodes, 2 modes, 145 steps; the search takes off nine tenths of its shake.
_SHOT = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
import small_shots

def edit(stage):
    small_shots.make_flexible(stage, youngsModulus=1e8)
    small_shots.make_target(stage)

small_shots.write_arm(Path(sys.argv[1]), edit)
"""


@dataclass(frozen=True)
class Workspace:
    """Folders of a campaign.

    Attributes:
        root: Everything lies in it.
        kernels: Names of the compiled kernels that a run makes again where they are missing; empty: not known.
    """

    root: Path
    kernels: list[str] = field(default_factory=list, compare=False)

    @property
    def shot(self) -> Path:
        """The shot."""
        return self.root / "shot" / "arm.usda"

    @property
    def cache(self) -> Path:
        """The cache folder of the runs."""
        return self.root / "cache"

    @property
    def warm(self) -> Path:
        """A copy of the caches after an undisturbed run."""
        return self.root / "warm"

    @property
    def out(self) -> Path:
        """Folder of the outputs."""
        return self.root / "out"

    @property
    def temporary(self) -> Path:
        """The system's folder for temporary files, as the runs see it."""
        return self.root / "tmp"

    @property
    def expected(self) -> Path:
        """Outputs of an undisturbed run."""
        return self.root / "expected"

    def arguments(self, figures: bool) -> list[str]:
        """The command line of a run, after the program's name."""
        files = ["-o", "calm.usda", "--csv", "calm.csv", "--rrd", "calm.rrd", *(["--figures", "."] if figures else [])]
        named = [str(self.out / text) if k % 2 else text for k, text in enumerate(files)]
        return ["optimize", str(self.shot), *named, *OPTIONS]

    def prepare(self, keep_caches: bool = False) -> None:
        """Make the folders and the shot; warm caches of an earlier campaign may stay."""
        for folder in (self.shot.parent, self.cache, self.out, self.temporary):
            empty(folder)
        if keep_caches and self.warm.is_dir():
            shutil.copytree(self.warm, self.cache, dirs_exist_ok=True)
        helpers = str(HERE.parent / "helpers" / "usd")
        environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "pipeline")}
        subprocess.run([sys.executable, "-c", _SHOT, str(self.shot), helpers], check=True, env=environment)

    def environment(self) -> dict[str, str]:
        """Variables of the runs."""
        return {
            "CALMOTION_CACHE": str(self.cache), "TMPDIR": str(self.temporary), "OPENBLAS_NUM_THREADS": "1",
            "RUST_LOG": "off", "CALMOTION_CONFIG": str(self.root / "no-config"),
            "MPLCONFIGDIR": str(self.root / "matplotlib"),
        }  # fmt: skip

    def keep(self) -> None:
        """Keep caches and outputs of the undisturbed run."""
        for source, copy in ((self.cache, self.warm), (self.out, self.expected)):
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(source, copy)

    def reset(self, old_outputs: bool = False) -> None:
        """Warm caches, empty temporary files, and no outputs or those of an earlier run."""
        for folder, source in ((self.cache, self.warm), (self.out, self.expected if old_outputs else None)):
            empty(folder)
            if source is not None:
                shutil.copytree(source, folder, dirs_exist_ok=True)
        empty(self.temporary)

    def cool(self, rng: random.Random, part: str = "") -> str:
        """Remove a part of the caches, or one drawn at random, so that a run writes it again; what was removed."""
        part = part or rng.choice(("kernels", "meshes", "reductions", "nothing"))
        if part == "kernels":  # one small kernel: a larger part of them would compile for minutes
            self.remove_kernel(rng.choice(self.kernels or self.kernel_names()))
        elif part != "nothing":
            for path in (self.cache / part).iterdir():
                path.unlink()
        return part

    def remove_kernel(self, name: str) -> None:
        """Remove a compiled kernel from the cache."""
        for path in self.cache.glob(f"kernels/**/{name}*"):
            path.unlink()

    def kernel_names(self) -> list[str]:
        """Names of the compiled kernels in the cache."""
        return sorted({path.stem for path in self.cache.glob("kernels/*/**/*.nbi")})

    def files(self) -> set[str]:
        """Names of all files in caches, outputs and temporary files."""
        return {
            f"{folder.name}/{path.relative_to(folder)}"
            for folder in (self.cache, self.out, self.temporary)
            for path in folder.rglob("*")
            if not path.is_dir() or path.is_symlink()
        }


def empty(folder: Path) -> None:
    """Make a folder empty, which may be the root of a file system; a missing one is made."""
    if folder.is_symlink() or folder.is_file():
        folder.unlink()
    folder.mkdir(parents=True, exist_ok=True)
    for path in folder.iterdir():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
