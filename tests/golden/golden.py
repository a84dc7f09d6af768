"""Golden numbers: what `optimize` promises on the samples and on three robots of others, compared with a file.

    python tests/golden/golden.py write FILE [SHOT ...]     # measure and keep
    python tests/golden/golden.py compare FILE [SHOT ...]   # measure and compare; exit status 1 where they differ

A shot's numbers agree where each error at a target is within a tenth of the shot's tolerance of the kept one, the
verdict is the same, and the first frequencies are within 2%. The robots of others are read from the folder
CALMOTION_DATA, and left out where they are not there.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SAMPLES = ("bartender", "boxer", "dancer", "drummer", "lamp", "rapper")
# name: layer of ours, file of others, seconds of the motion
ROBOTS = {
    "kuka": ("iiwa_reach.usda", "converted/kuka_iiwa_14/iiwa14.usda", None),
    "so101": ("so101_arms.usda", "converted/so101_urdf/so101_new_calib.usda", None),
    "g1": ("g1_arms.usda", "shots/g1_dual_arm_disco.usda", 3.0),
}
SHARE_OF_TOLERANCE, SHARE_OF_FREQUENCY = 0.1, 0.02


def shot_file(name: str, folder: Path) -> Path | None:
    """The USD file of a shot; None where the robot's files are not on this machine."""
    if name in SAMPLES:
        return ROOT / "samples" / name / f"{name}.usda"
    layer, robot, seconds = ROBOTS[name]
    file = Path(os.environ.get("CALMOTION_DATA", ROOT.parent / "shared" / "data")) / robot
    if not file.is_file():
        return None
    compose = [
        str(ROOT / "samples/real/compose.py"),
        str(ROOT / "samples/real" / layer),
        str(file),
        str(folder / f"{name}.usda"),
    ]
    run([sys.executable, *compose, *([] if seconds is None else ["--seconds", str(seconds)])])
    return folder / f"{name}.usda"


def run(command: list[str]) -> str:
    """What a command prints to stdout; its exit status 1 is a verdict, anything above it an error."""
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    if done.returncode > 1 or not done.stdout:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    return done.stdout


def measured(name: str) -> dict[str, Any] | None:
    with tempfile.TemporaryDirectory() as folder:
        shot = shot_file(name, Path(folder))
        if shot is None:
            return None
        began = time.perf_counter()
        found = json.loads(
            run([sys.executable, "-m", "calmotion", "optimize", str(shot), "-o", f"{folder}/calm.usda", "--json"])
        )
        print(f"{name}: {time.perf_counter() - began:.1f} s", flush=True)
        return numbers(found)


def numbers(found: dict[str, Any]) -> dict[str, Any]:
    """Of a report of `optimize --json`, what a change of the code must not change."""
    errors = {
        target["path"]: {
            key: target[key]
            for key in ("max_error_before_m", "max_error_after_m", "rms_error_before_m", "rms_error_after_m")
        }
        for target in found["targets"]
    }
    frequencies = {path: values[:3] for path, values in found["frequencies_hz"].items()}
    kept = {key: found.get(key) for key in ("tolerance_m", "tolerance_kept")}
    return {"errors_m": errors, "frequencies_hz": frequencies, **kept}


def differences(name: str, old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """A line for each number that differs by more than the docstring of the module allows."""
    lines = []
    if old["tolerance_kept"] != new["tolerance_kept"]:
        lines.append(f"{name}: tolerance_kept {old['tolerance_kept']} -> {new['tolerance_kept']}")
    for path, errors in old["errors_m"].items():
        for key, value in errors.items():
            found = new["errors_m"].get(path, {}).get(key, float("nan"))
            if not abs(found - value) <= SHARE_OF_TOLERANCE * old["tolerance_m"]:
                moved = f"{1e3 * value:.4f} -> {1e3 * found:.4f} mm (tolerance {1e3 * old['tolerance_m']:.3g})"
                lines.append(f"{name}: {path} {key} {moved}")
    for path, values in old["frequencies_hz"].items():
        for mode, (value, found) in enumerate(
            zip(values, new["frequencies_hz"].get(path, [float("nan")] * 3), strict=False), 1
        ):
            if not abs(found - value) <= SHARE_OF_FREQUENCY * value:
                lines.append(f"{name}: {path} mode {mode} {value:.4g} -> {found:.4g} Hz")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("write", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument("shots", nargs="*", default=[*SAMPLES, *ROBOTS])
    arguments = parser.parse_args()
    kept: dict[str, Any] = json.loads(arguments.file.read_text()) if arguments.file.is_file() else {}
    differ: list[str] = []
    for name in arguments.shots:
        new = measured(name)
        if new is None:
            print(f"{name}: left out, its files are not on this machine", flush=True)
            continue
        if arguments.what == "write":
            lines = []
        elif name in kept:
            lines = differences(name, kept[name], new)
        else:
            lines = [f"{name}: no numbers are kept of it"]
        done = "kept" if arguments.what == "write" else "agrees"
        print(*lines or [f"{name}: {done}"], sep="\n", flush=True)
        differ += lines
        if arguments.what == "write":
            kept[name] = new
            arguments.file.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
