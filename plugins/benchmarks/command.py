"""`calmotion bench`: error against run time, measured."""

import argparse

from calmotion.cli import Output, entry

WHAT = {
    "work-precision": ("accuracy.work_precision", "error against run time of every setting"),
    "tolerances": ("accuracy.tolerances", "measured error of shots that are simulated or optimised to a tolerance"),
    "estimates": ("accuracy.estimates", "estimated against measured error, on random shots"),
    "calibration": ("accuracy.calibration", "known parameters of random arms, found from noisy recordings"),
    "measured": ("accuracy.measured", "real machines: what fits of some recordings predict of the others"),
    "meshing": ("links.meshing", "links of robots: their solids, meshes, frequencies and errors"),
    "integrators": ("integrators.integrators", "orders of the integrators, against RK4 at a fine step"),
    "stability": ("integrators.stability", "maps of each integrator over stiffness, speed, load and step"),
    "gradients": ("optimizer.gradients", "both adjoints against differences"),
    "optimizer": ("optimizer.optimizer", "Gauss-Newton and a quasi-Newton method"),
    "baselines": ("optimizer.baselines", "input shapers, a filter and the optimised curves"),
    "motor-commands": ("motors.commands", "optimised commands of servos, replayed in MuJoCo"),
    "diagnose": ("accuracy.diagnosis", "known faults of random arms, found from noisy recordings"),
    "tempo": ("motors.tempo", "time and error that slower motors cost, against TOPP-RA and one tempo"),
    "live": ("motors.live", "streams that are calmed while they are played, and input shapers"),
    "speed": ("speed.stages", "where the time of a run goes"),
    "robots": ("speed.robots", "processor time by stage and memory of robots with two flexible links"),
    "scaling": ("speed.scaling", "growth of the run time with bodies, steps and modes"),
}
BENCHMARKS = {name: module for name, (module, _) in WHAT.items()}

EXAMPLES = (("calmotion bench work-precision", "error against run time of every setting"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} `calmotion bench NAME --help` lists the arguments of one."
    command.add_argument("name", metavar="NAME", choices=tuple(BENCHMARKS), help="a benchmark, see below")
    lines = [line for name, (_, text) in WHAT.items() for line in entry(name, text, max(map(len, WHAT)) + 4)]
    command.add_argument_group("benchmarks", "\n".join(lines))
    command.add_argument("arguments", nargs=argparse.REMAINDER, help="arguments of the benchmark")


def run(args: argparse.Namespace, output: Output) -> int:
    from importlib import import_module

    try:
        module = import_module(f".{BENCHMARKS[args.name]}", __package__)
    except ModuleNotFoundError as error:
        from calmotion.host import SettingError

        package, _, plugin = (error.name or "").partition(".")
        if package != "calmotion_plugins":
            raise
        raise SettingError(
            f"the benchmark {args.name} needs the plugin {plugin}, which is not there",
            remedy="Put its folder back, or install Calmotion again.",
        ) from error
    status: int = module.main(args.arguments)
    return status
