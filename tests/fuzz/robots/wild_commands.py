"""Commands on wild robots: each ends in numbers, or is refused with a place and a remedy."""

import contextlib
import random
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from robots import draw
from stages import write
from tellings import any_telling

TESTS = Path(__file__).resolve().parents[2]
for folder in (TESTS / "hostile", TESTS / "helpers" / "usd"):
    sys.path.insert(0, str(folder))

import hostile  # noqa: E402

LONGEST = 240  # processor time of one run [s]
FORMATS = ("ros2", "csv", "ticks", "ur", "bottango")
OUTPUTS = (
    "out.usda", "out_root.usda", "out_model.usda", "out_model_root.usda", "out.csv", "out.html", "commands.out",
    "figures",
)  # fmt: skip
OPTIMIZE = ("optimize", "{shot}", "-o", "out.usda", "--set", "retarget.optimize.max_iterations=3")
RECORDED = ("--recording", "recording.csv")
ROBUST = "--set retarget.optimize.scenarios=3 --set retarget.optimize.draws=20 --set retarget.optimize.robust"
WORDS = (
    *(
        (*OPTIMIZE, *more.split())
        for more in (
            "--retime", "--bake simulated", "--bake motors", "--splines", "--verify", "--goal 1mm", f"{ROBUST}=mean",
            f"{ROBUST}=worst", "--motors ideal", "--pre-roll 0s",
            "--samples-per-second 100",
        )
    ),
    *(
        ("simulate", "{shot}", *more.split())
        for more in (
            "--motors ideal --csv out.csv", "--integrator newmark", "--integrator rk4", "--verify", "--shaper zv",
            "--integrator generalized-alpha", "--html out.html", "--figures figures", "--step 1ms",
            "-o out.usda --bake simulated", "--shaper lowpass",
        )
    ),
    *(("export", "{shot}", "--to", to, "-o", "commands.out") for to in FORMATS),
    *(("inspect", "{shot}", more) for more in ("--strict", "--meshes", "--live")),
    *(("calibrate", "{shot}", *RECORDED, "-o", "out.usda"), ("refine", "{shot}", *RECORDED, "-o", "out.usda")),
    *(("diagnose", "{shot}", *RECORDED), ("live", "{shot}", "--replay", "{shot}")),
    *(("excite", "{shot}", "-o", "out.usda", "--tries", "20"), ("rig", "{shot}", "-o", "out.usda")),
)  # fmt: skip


def commands(seed: int, folder: Path) -> tuple[str, list[str]]:
    """Commands on a wild robot; its kind and ending, and what is wrong."""
    r = random.Random(seed)
    telling = any_telling(seed)
    if telling.composed == "instance" and r.random() < 0.9:
        telling = replace(telling, composed="reference")
    robot = draw(seed, wild=True)
    file = write(robot, telling, folder)
    found, endings = [], []
    take = ("simulate", "{shot}", "-o", "out.usda", "--csv", "take.csv")
    for words in (("inspect", "{shot}"), take, OPTIMIZE, *r.sample(WORDS, 2)):
        if "recording.csv" in words and not (folder / "recording.csv").exists():
            continue
        ending, faults = ended(words, file, folder)
        endings.append(ending)
        found += [f"{' '.join(words)}: {fault}" for fault in faults]
        if words[0] == "simulate" and (folder / "take.csv").exists():
            record(folder, r)
    return f"{robot.kind}: {', '.join(endings)}", found


def ended(words: tuple[str, ...], file: Path, folder: Path) -> tuple[str, list[str]]:
    """How a command on a shot ended, and what is wrong with it."""
    for name in OUTPUTS:
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).unlink(missing_ok=True)
    command = (*(word.replace("{shot}", file.name) for word in words), *(() if words[0] == "live" else ("--json",)))
    case = hostile.Case(lambda _: None, command, hostile.EITHER, outputs=(*OUTPUTS, "take.csv"), seconds=LONGEST)
    ending, faults = hostile.run(case, folder)
    problem = ""
    if ending.status == 1 and words[0] != "live":
        with contextlib.suppress(ValueError):
            problem = str((hostile.json.loads(ending.out).get("error") or {}).get("problem"))
    if any(word in problem + ending.err for word in ("maintainer", "internal error", "Warning:", " raised ")):
        faults = [*faults, f"an internal error: {(problem + ending.err)[-600:]}"]
    return f"{words[0]} {'done' if ending.status == 0 else problem[:90]} {ending.seconds:.0f}s", faults


def record(folder: Path, r: random.Random) -> None:
    """Make a recording of a take: markers and angles with noise, some cells empty."""
    lines = (folder / "take.csv").read_text().splitlines()
    names = lines[0].split(",")
    kept = [k for k, name in enumerate(names) if name == "time_s" or name.endswith((".x", ".y", ".z", ".output"))]
    rows = [",".join(names[k].replace(".output", ".angle") for k in kept)]
    for line in lines[1:]:
        cells = line.split(",")
        rows.append(",".join(cells[k] if k == kept[0] else f"{float(cells[k]) + r.gauss(0, 1e-4):.9g}" for k in kept))
    (folder / "recording.csv").write_text("\n".join(rows) + "\n")
