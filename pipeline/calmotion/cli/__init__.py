"""The command line, and what commands of plugins use of it. Each name is imported when it is first used.

A command is a module with `add_arguments(parser)` and `run(arguments, output) -> int`, which returns the exit status;
its `EXAMPLES`, pairs of a command line and what it is for, stand below its help.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calmotion.cli.options import (
        assignments,
        count_of,
        json_option,
        opened_shot,
        plugin_option,
        progress_display,
        quantity,
        report_options,
        run_arguments,
        run_options,
        shot_arguments,
        simulation_arguments,
        simulation_options,
    )
    from calmotion.cli.output import FAILED, INTERRUPTED, Output, conclude, notice, print_error
    from calmotion.cli.parser import entry
    from calmotion.cli.progress import ProgressDisplay
    from calmotion.cli.quantities import angle, counted, length, measured, quantity_in
    from calmotion.cli.tables import console_on, print_table, say

__all__ = [
    "FAILED",
    "INTERRUPTED",
    "Output",
    "ProgressDisplay",
    "angle",
    "assignments",
    "conclude",
    "console_on",
    "count_of",
    "counted",
    "entry",
    "json_option",
    "length",
    "measured",
    "notice",
    "opened_shot",
    "plugin_option",
    "print_error",
    "print_table",
    "progress_display",
    "quantity",
    "quantity_in",
    "report_options",
    "run_arguments",
    "run_options",
    "say",
    "shot_arguments",
    "simulation_arguments",
    "simulation_options",
]

_HOMES = {
    "cli.options": (
        "assignments", "count_of", "json_option", "opened_shot", "plugin_option", "progress_display", "quantity",
        "report_options", "run_arguments", "run_options", "shot_arguments", "simulation_arguments",
        "simulation_options",
    ),
    "cli.output": ("FAILED", "INTERRUPTED", "Output", "conclude", "notice", "print_error"),
    "cli.parser": ("entry",),
    "cli.progress": ("ProgressDisplay",),
    "cli.quantities": ("angle", "counted", "length", "measured", "quantity_in"),
    "cli.tables": ("console_on", "print_table", "say"),
}  # fmt: skip


def __getattr__(name: str) -> Any:
    from calmotion.public_names import imported

    return imported(__name__, _HOMES, name)


def __dir__() -> list[str]:
    return sorted(__all__)
