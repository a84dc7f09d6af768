"""One robot told in two ways has the same motion, and what is written performs as it was told."""

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
from robots import Robot, draw
from stages import write
from tellings import CHANGES, Telling, changed

STEP = 1 / 480
SAME = 2e-5  # of the reach, or of the largest value of a curve: files have single precision
SHARE = 2e-3  # of the largest error


def quantities(file: Path, telling: Telling, robot: Robot) -> dict[str, np.ndarray]:
    """Errors of the targets, curves and efforts of the motors, and frequencies, by name."""
    import calmotion as cm

    result = cm.simulate(str(file), step=STEP, keep=("all",))
    out = {}
    for path, target in result.targets.items():
        name = path.rsplit("/", 1)[1]
        out[f"error {name}"], out[f"turn {name}"] = target.error, target.rotation_error
        back = np.linalg.inv(telling.world)
        out[f"place {name}"] = target.position @ back[:3, :3].T + back[:3, 3]
    for path, motor in result.motors.items():
        k = int(path.rsplit("/J", 1)[1])
        sign = -1.0 if k in telling.exchanged else 1.0
        out[f"effort J{k}"] = sign * motor.effort
        out[f"curve J{k}"] = sign * (motor.output - motor.output[0])
    report = cm.inspect(str(file), keep=("all",)).report()
    modes = report.get("modes") or []
    out["frequencies"] = np.array([row["frequency_hz"] for row in modes if row.get("frequency_hz")][:4])
    return out


def tellings(seed: int, folder: Path) -> tuple[str, list[str]]:
    """A robot told in two ways."""
    from calmotion import ShotError

    r = random.Random(seed)
    name = r.choice(list(CHANGES))
    robot = draw(
        seed, wild=name != "posed" and r.random() < 0.3, dense=name == "posed",
        kind={"posed": "branched", "kinematic": "free base", "fixed": "free base"}.get(name),
    )  # fmt: skip
    base, other = Telling(geometry="tets"), replace(changed(name, seed), geometry="tets")
    results, refusals = [], []
    for k, telling in enumerate((base, other)):
        try:
            results.append(quantities(write(robot, telling, folder / "ab"[k]), telling, robot))
        except ShotError as error:
            refusals.append(f"{error.problem}" if hasattr(error, "problem") else str(error)[:100])
    if refusals:
        where = f"{robot.kind}, {name}: refused: {refusals[0][:100]}"
        return where, [f"one of two is refused, {name}: {refusals}"] if len(refusals) == 1 else []
    slack = 5.0 if other.welded else 1.0  # two bodies have other errors of the step than one
    return f"{robot.kind}, {name}: same", compared(robot, *results, slack=slack)


def written(seed: int, folder: Path) -> tuple[str, list[str]]:
    """What optimize writes performs as it says when it is opened again; it is optimised in no other telling worse."""
    import calmotion as cm

    r = random.Random(seed)
    robot, name = draw(seed, wild=r.random() < 0.3), r.choice(list(CHANGES)[:-1])
    dense, telling = name == "posed", replace(changed(name, seed), geometry="tets")
    if dense:
        robot = draw(seed, wild=False, kind="branched", dense=True)
    file, layer = write(robot, telling, folder), str(folder / "calm.usda")
    options = {"step": STEP, "keep": ("all",), "pre_roll": 0.25 if r.random() < 0.3 else None}
    result = cm.optimize(str(file), settings={"retarget.optimize": {"max_iterations": 4}}, **options)
    rate = None if r.random() < 0.5 else 120.0
    result.write(layer, samples_per_second=rate, splines=rate is None and r.random() < 0.5)
    again = cm.simulate(layer.replace("calm.", "calm_root."), **options)
    found, largest = [], max(target.max_error for target in result.before.targets.values())
    for path, target in result.targets.items():
        other = next(t for p, t in again.targets.items() if p.rsplit("/", 1)[1] == path.rsplit("/", 1)[1])
        off = np.abs(target.error - other.error).max() if len(target.error) == len(other.error) else np.nan
        coarse = 1e-4 if rate is None else 1e-3  # knots may lie between samples of another rate
        if not off <= coarse * robot.reach + 2e-2 * max(largest, target.max_error):
            found.append(
                f"{name}: written curves err {off:.3g} m otherwise than {target.max_error:.3g}, before {largest:.3g}"
            )
    limited = any(
        row["exceeded"]
        or any(row[when] is None or abs(row[when]) > 0.98 * abs(row["limit"]) for when in ("before", "after"))
        for row in result.report()["limits"]
    )
    if not limited and not result.improved or not limited and result.max_error > 1.02 * largest + 1e-6:
        found.append(f"{name}: worse than the animation: {largest:.3g} -> {result.max_error:.3g} m")
    return f"{robot.kind}, {name}: {largest:.3g} -> {result.max_error:.3g}", found


def compared(robot: Robot, one: dict, two: dict, slack: float = 1.0) -> list[str]:
    """Differences beyond what single precision explains, times a slack."""
    if set(one) != set(two):
        return [f"different names: {sorted(set(one) ^ set(two))}"]
    largest = max(np.abs(v).max(initial=0.0) for k, v in one.items() if k.startswith("error"))
    found = []
    for name, a in one.items():
        b = two[name]
        if a.shape != b.shape:
            found.append(f"{name}: {a.shape} and {b.shape}")
            continue
        size = max(np.abs(a).max(initial=0.0), 1e-9)
        allowed = SAME * robot.reach + SHARE * largest
        if name.startswith("turn"):
            allowed = SAME + SHARE * size
        elif name.startswith("effort"):
            allowed = 2e-3 * max(size, 1e-2 * _weight(robot))
        elif name.startswith(("curve", "freq")):
            allowed = 1e-4 + 2e-3 * size if name.startswith("freq") else 2e-6 + 1e-4 * size
        off = np.abs(a - b).max(initial=0.0)
        if not off <= slack * allowed:
            found.append(f"{name}: {off:.3g} apart, largest {size:.3g}")
    return found


def _weight(robot: Robot) -> float:
    """Of all bodies on the reach [N m]."""
    return 9.81 * sum(s.mass for s in robot.solids) * robot.reach
