"""Growth of the run time with bodies, duration and modes, and comparison with Exudyn and MuJoCo.

`calmotion bench scaling [--quick] [--json]` measures, in one run and with one thread,

- time per step of chains of 4 to 128 flexible links, of 1,000 to 100,000 steps, and of 4 to 64 modes in a link, with
  the exponents of their growth;
- a step of a tree of 14 flexible bodies of 10 modes;
- where they are installed (the optional extra `bench`), the swung arm against Exudyn's reduced flexible bodies and
  against a chain of as many rigid segments in MuJoCo, at equal error.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import show
from calmotion.benchmarks.speed.growth import Growth, branches, growths, prepared, step_time
from calmotion.linear_algebra.blas_threads import one_blas_thread

NAMES = {"exudyn": "Exudyn's reduced body", "mujoco": "MuJoCo's chain"}


@one_blas_thread()
def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("scaling", __doc__)
    parser.add_argument("--quick", action="store_true", help="fewer and smaller sizes")
    output_options(parser)
    options = parser.parse_args(arguments)
    measured = growths((4, 8, 16, 32), (1_000, 5_000), (4, 8, 16, 32)) if options.quick else growths()
    tree = step_time(prepared(*branches()), 400)
    peers = [] if options.quick else _peers()
    if options.json:
        print(json.dumps(_report(measured, tree, peers)))
    else:
        _print(measured, tree, peers)
    return 0


def _peers() -> list[Any]:
    """The swung arm by the codes that are installed, and by ours."""
    from calmotion.benchmarks.scenes import exudyn_arm, mujoco_arm

    codes: dict[str, Any] = {}
    if exudyn_arm.installed():
        codes["exudyn"] = exudyn_arm.Exudyn()
    if mujoco_arm.installed():
        codes["mujoco"] = mujoco_arm.MujocoChain()
    return exudyn_arm.compare(codes)


def _times_faster(peers: list[Any], peer: str) -> list[dict[str, Any]]:
    """Run time of a peer over that of each of our integrators, at equal errors; empty without the peer."""
    from calmotion.benchmarks.scenes.exudyn_arm import LEVELS, time_at

    codes = list(dict.fromkeys(run.code for run in peers))
    return [
        {"code": code, "error_m": level, "ratio": time_at(peers, peer, level) / time_at(peers, code, level)}
        for code in codes
        if code not in NAMES and peer in codes
        for level in LEVELS
    ]


def _report(measured: Sequence[Growth], tree: float, peers: list[Any]) -> dict[str, Any]:
    return {
        "growth": [asdict(growth) | {"exponent": growth.exponent} for growth in measured],
        "tree_step_s": tree,
        "exudyn": [asdict(run) for run in peers if run.code != "mujoco"],
        "times_faster_than_exudyn": _times_faster(peers, "exudyn"),
        "mujoco": [asdict(run) for run in peers if run.code == "mujoco"],
        "times_faster_than_mujoco": _times_faster(peers, "mujoco"),
    }


def _print(measured: Sequence[Growth], tree: float, peers: list[Any]) -> None:
    report = _report(measured, tree, peers)
    for growth in measured:
        shown = [
            [f"{value:,}", f"{1e6 * seconds:,.0f}"]
            for value, seconds in zip(growth.values, growth.seconds, strict=True)
        ]
        show(f"{growth.name}: exponent {growth.exponent:.2f}", [growth.name, "time [us]"], shown, texts=0)
    print(f"a step of 14 bodies of 10 modes: {1e6 * tree:.0f} us")
    missing = [title for code, title in NAMES.items() if code not in {run.code for run in peers}]
    if missing:
        print(f"not compared: {', '.join(missing)}; install the extra `bench`, and leave out --quick")
    shown = [[run.code, str(run.steps), f"{run.error:.1e}", f"{run.wall_s:.4f}"] for run in peers]
    show("The swung arm, 14 coordinates", ["code", "steps", "error [m]", "time [s]"], shown)
    for code, title in NAMES.items():
        for row in report[f"times_faster_than_{code}"]:
            print(f"{row['code']}: {row['ratio']:.3g} times as fast as {title} at an error of {row['error_m']:.0e} m")


if __name__ == "__main__":
    sys.exit(main())
