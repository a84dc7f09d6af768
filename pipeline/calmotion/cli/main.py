"""The command line reads arguments, calls `calmotion.workflow` and prints; `--help` imports nothing heavy."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from calmotion.cli.commands.table import BUILT_IN, all_commands
from calmotion.cli.parser import Parser, add_examples, overview
from calmotion.cli.signals import as_interrupts, flushed, ignore, prepare_streams
from calmotion.errors import ShotError
from calmotion.version import __version__

if TYPE_CHECKING:
    from calmotion.cli.output import Output

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
        prepare_streams()
    with as_interrupts(ends=arguments is None):
        try:
            status = _run(given)
        except KeyboardInterrupt:
            ignore()
            from calmotion.cli.output import Output, print_error

            print_error(ShotError("interrupted"), Output(sys.stdout, "--json" in given))
            status = INTERRUPTED
    if arguments is None and not flushed(told=status != 0):
        return status or FAILED
    return status


def _run(given: list[str]) -> int:
    if not given:
        build_parser("").print_help(sys.stderr)
        return WRONG_USAGE
    given = [ALIASES.get(given[0], given[0]), *given[1:]]
    try:
        name = next((text for text in given if not text.startswith("-")), "")
        args = build_parser(name).parse_args(given)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else WRONG_USAGE
    except Exception as error:
        from calmotion.cli.output import Output

        return _failed(error, Output(sys.stdout, "--json" in given))
    from calmotion.cli.output import own_messages, protected_stdout

    with protected_stdout(getattr(args, "json", False)) as output, own_messages():
        try:
            status: int = args.command(args, output)
            return status
        except BrokenPipeError:
            return FAILED
        except Exception as error:
            return _failed(error, output)


def _failed(error: Exception, output: Output) -> int:
    """Print why nothing was done; the exit status."""
    from calmotion.cli.output import print_error, print_fault
    from calmotion.host.errors import SettingError

    if not isinstance(error, ShotError):
        print_fault(error, output)
        return FAILED
    print_error(error, output)
    return WRONG_USAGE if isinstance(error, SettingError) else FAILED


def build_parser(chosen: str | None = None) -> Parser:
    """The parser of all commands.

    Args:
        chosen: The command whose options it knows, since its module alone is imported; None: it knows those of all.

    Raises:
        ShotError: The command is that of a plugin, and cannot be called.
    """
    parser = Parser(prog="calmotion")
    parser.add_argument("--version", action="version", version=f"calmotion {__version__}")
    group = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    commands = BUILT_IN if chosen in BUILT_IN else all_commands()
    for name, command in commands.items():
        if name == chosen or (chosen is None and not command.disabled):
            module = command.load()
            text = command.help
            command_parser = group.add_parser(name, help=text, description=f"{text[:1].upper()}{text[1:]}.")
            module.add_arguments(command_parser)
            command_parser.set_defaults(command=module.run)
            command_parser.operators = getattr(module, "OPERATORS", ())
            add_examples(command_parser, getattr(module, "EXAMPLES", ()))
        elif not command.disabled:
            group.add_parser(name, help=command.help)
    parser.overview = overview({action.dest: action.help or "" for action in group._choices_actions})
    return parser


if __name__ == "__main__":
    sys.exit(main())
