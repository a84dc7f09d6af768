"""The command line reads arguments, calls `calmotion.workflow` and prints; `--help` imports nothing heavy."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from calmotion.cli.commands.robots import import_robot, materials, motors, rig
from calmotion.cli.commands.setup import bench, cache, completion, doctor, plugins, warmup
from calmotion.cli.commands.shots import calibrate, excite, export, inspect, optimize, refine, simulate
from calmotion.cli.commands.shows import batch, sequence, submit
from calmotion.cli.diagnostics.streams import open_closed_streams
from calmotion.cli.parser import Parser, add_examples, overview
from calmotion.cli.signals import as_interrupts, ignore
from calmotion.errors import ShotError, failure_of_machine
from calmotion.support.memory import was_short
from calmotion.version import __version__

FAILED, WRONG_USAGE, INTERRUPTED = 1, 2, 130
ALIASES = {"optimise": "optimize"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command.

    Args:
        arguments: Those after the program's name; None: those of this process, which ends with the command.

    Returns:
        0 done, 1 the shot cannot be processed, 2 wrong usage, 130 interrupted.
    """
    given = sys.argv[1:] if arguments is None else list(arguments)
    if arguments is None:
        open_closed_streams()
    with as_interrupts(ends=arguments is None):
        try:
            return _run(given)
        except KeyboardInterrupt:
            ignore()
            from calmotion.cli.output import Output, print_error

            print_error(ShotError("interrupted"), Output(sys.stdout, "--json" in given))
            return INTERRUPTED


def _run(given: list[str]) -> int:
    if not given:
        build_parser().print_help(sys.stderr)
        return WRONG_USAGE
    try:
        args = build_parser().parse_args([ALIASES.get(given[0], given[0]), *given[1:]])
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else WRONG_USAGE
    from calmotion.cli.output import own_messages, print_error, printable, protected_stdout, refuse_missing_folder

    with printable(), protected_stdout(args.json) as output, own_messages():
        try:
            refuse_missing_folder()
            status: int = args.command(args, output)
            return status
        except ShotError as error:
            from calmotion.host import SettingError

            print_error(error, output)
            return WRONG_USAGE if isinstance(error, SettingError) else FAILED
        except BrokenPipeError:
            return FAILED
        except Exception as error:
            from calmotion.cli.diagnostics.crash_report import crash

            print_error(failure_of_machine(error, was_short()) or crash(error, given), output)
            return FAILED


def build_parser() -> Parser:
    """The parser of all commands."""
    parser = Parser(
        prog="calmotion",
        description="Retargets the animation of a flexible robotic character so that it does not shake.",
        epilog="Exit status: 0 done, 1 the shot cannot be processed, 2 wrong usage, 130 interrupted.",
    )
    parser.add_argument("--version", action="version", version=f"calmotion {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for command in (
        inspect,
        simulate,
        optimize,
        calibrate,
        excite,
        refine,
        batch,
        sequence,
        submit,
        export,
        import_robot,
        rig,
        motors,
        materials,
        bench,
        plugins,
        warmup,
        cache,
        doctor,
        completion,
    ):
        command.add_to(commands)
    for name, command_parser in commands.choices.items():
        add_examples(name, command_parser)
    parser.overview = overview({action.dest: action.help or "" for action in commands._choices_actions})
    parser.set_defaults(parser=parser)  # for `completion`
    return parser


if __name__ == "__main__":
    sys.exit(main())
