"""The parser of arguments, and its help: one screen by task, and examples for each command.

A wrong option or command is answered with the nearest right one.
"""

from __future__ import annotations

import argparse
import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from calmotion.support.naming import nearest, nearest_name

if TYPE_CHECKING:
    from calmotion.host import Property

# Commands that are named nowhere here, of plugins of others, stand in a group of their own.
TASKS = (
    ("Prepare a shot", ("import", "rig", "motors", "materials", "inspect")),
    ("Remove the shake", ("diagnose", "simulate", "optimize", "watch", "live", "excite", "calibrate", "refine")),
    ("Work on a show", ("batch", "sequence", "submit")),
    ("Play it on the robot", ("export",)),
    ("Measure, extend, set up", ("demo", "bench", "plugins", "warmup", "doctor", "cache")),
)
START = (
    ("calmotion inspect shot.usda", "what is in the shot?"),
    ("calmotion optimize shot.usda -o calm.usda", "remove the shake"),
)
# The group of options that every command on a shot has.
SHARED = "reports, plugins and settings"
WIDTH = 79
_EXAMPLES = "examples:\n"
# A value, not an option: so that -2ms is refused by what reads a quantity. The expression is that of Python 3.14.
_NEGATIVE = re.compile(r"-\.?\d")


def overview(commands: Mapping[str, str]) -> str:
    """The help of the program.

    Args:
        commands: What each command does, in the order in which they are listed.
    """
    lines = [
        "usage: calmotion COMMAND [options]",
        "",
        "Robots shake when they perform fast animation. Calmotion simulates the robot of",
        "a USD shot with its flexible links, and changes the motor curves so that it",
        "performs the intended motion without the shake.",
    ]
    column = max(map(len, commands), default=0) + 4
    listed = {name for _, names in TASKS for name in names}
    others = tuple(name for name in commands if name not in listed)
    for title, names in (*TASKS, ("Of further plugins", others)):
        group = [name for name in names if name in commands]
        lines += ["", f"{title}:"] if group else []
        lines += [line for name in group for line in entry(name, commands[name], column)]
    lines += ["", "Start with:", *example_lines(START), ""]
    lines += [
        "calmotion COMMAND --help lists the options of a command, with examples.",
        "Exit status: 0 done, 1 the shot cannot be processed, 2 wrong usage,",
        "130 interrupted.",
    ]
    return "\n".join(lines) + "\n"


def entry(name: str, text: str, column: int) -> list[str]:
    """A command and what it does, wrapped."""
    indent = " " * column
    return textwrap.wrap(text, WIDTH, initial_indent=f"  {name}".ljust(column), subsequent_indent=indent)


def example_lines(examples: Sequence[tuple[str, str]]) -> list[str]:
    """Commands with what they are for, in two columns where they fit."""
    column = max(len(command) for command, _ in examples) + 4
    lines = []
    for command, purpose in examples:
        line = f"  {command}".ljust(column) + f"# {purpose}"
        lines += [line] if len(line) <= WIDTH else [f"  # {purpose}", f"  {command}"]
    return lines


def add_examples(command: argparse.ArgumentParser, examples: Sequence[tuple[str, str]]) -> None:
    """Put examples below the options of a command, and what it needs at least into its usage."""
    # what a command alone has comes before what all have
    command._action_groups.sort(key=lambda group: group.title == SHARED)
    if examples:
        command.formatter_class = _WithExamples
        command.epilog = _EXAMPLES + "\n".join(example_lines(examples))
    if command.usage is None and not any(isinstance(a, argparse._SubParsersAction) for a in command._actions):
        command.usage = " ".join(["%(prog)s", *(needed(action) for action in command._actions if is_shown(action))])
        command.usage += " [options]"


def is_shown(action: argparse.Action) -> bool:
    """Whether the usage of a command has an argument: one that it needs, or a place that may stay empty."""
    return (action.required or not action.option_strings) and action.help != argparse.SUPPRESS


def needed(action: argparse.Action) -> str:
    """An argument as it is typed."""
    value = action.metavar if isinstance(action.metavar, str) else "|".join(action.choices or [action.dest.upper()])
    if not action.option_strings:
        return value if action.required else f"[{value}]"
    return f"{action.option_strings[0]} {value}"


def property_text(idname: str, declared: Property) -> str:
    """A property of an operator with its default, its range and its meaning."""
    limits = " | ".join(declared.choices) or declared.range_text()
    value = "auto" if declared.default is None else f"{declared.default!r} {declared.unit}".strip()
    default = value + (f" ({limits})" if limits else "")
    return f"{idname}.{declared.name} = {default}  {declared.description}"


def _properties_of(operators: Sequence[str]) -> str:
    """The properties of operators for a help; empty without operators. It loads the plugins."""
    if not operators:
        return ""
    from calmotion.host import open_host

    known = open_host([]).operators
    texts = [property_text(name, one) for name in operators if name in known for one in known[name].properties]
    lines = [textwrap.fill(text, WIDTH, initial_indent="  ", subsequent_indent="      ") for text in texts]
    return "properties, each with its default, for --set NAME=VALUE:\n" + "\n".join(lines) + "\n\n"


class _WithExamples(argparse.HelpFormatter):
    """Help whose examples and indented lists keep their lines; descriptions are wrapped."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return text if text.startswith((_EXAMPLES, "  ")) else super()._fill_text(text, width, indent)


class Parser(argparse.ArgumentParser):
    """Parser of a command, which refuses its own wrong options.

    Attributes:
        overview: The whole help, where it is not that of argparse.
        operators: Those whose properties the help lists, since `--set` is the way to choose them.
    """

    overview = ""
    operators: Sequence[str] = ()

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._negative_number_matcher = _NEGATIVE

    def format_help(self) -> str:
        """The help."""
        before, examples, after = (self.overview or super().format_help()).partition(_EXAMPLES)
        return before + _properties_of(self.operators) + examples + after

    def error(self, message: str) -> NoReturn:
        """End with what is wrong and where help is; the list of all options would hide it."""
        if self.overview:
            self.exit(2, f"error: {message}\n{self.prog} --help lists the commands.\n")
        inner = [action for action in self._actions if isinstance(action, argparse._SubParsersAction)]
        more = (
            f"has more: its commands are {', '.join(inner[0].choices)}" if inner else "lists the options, with examples"
        )
        self.exit(2, f"{self.format_usage()}error: {message}\n{self.prog} --help {more}.\n")

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """The arguments; those that no option takes are refused here, where the options are known."""
        found, rest = super().parse_known_args(args, namespace)
        wrong = next((text for text in rest if text.startswith("-")), None)
        if wrong is not None:
            name = wrong.partition("=")[0]
            near = nearest_name(name.lstrip("-"), [option.lstrip("-") for option in self._option_string_actions])
            late = " Options stand behind the command." if self.overview and not near else ""
            self.error(f"there is no option {name}." + (f" Did you mean --{near}?" if near else late))
        if rest and not self.overview:
            self.error(f"no argument takes {' '.join(rest)}; a name with spaces is written in quotation marks")
        return found, rest

    def _match_argument(self, action: argparse.Action, arg_strings_pattern: str) -> int:
        try:
            return super()._match_argument(action, arg_strings_pattern)
        except argparse.ArgumentError:
            name, value = action.option_strings[-1], needed(action).partition(" ")[2]
            dash = "" if action.choices else f", or {name}={value} if it begins with a dash"
            remedy = f"its value is missing. Write {name} {value}{dash}"
            raise argparse.ArgumentError(action, remedy) from None

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            near = nearest(str(value), map(str, action.choices or ()))
            raise argparse.ArgumentError(action, f"{error.message}. {near}" if near else error.message) from None
