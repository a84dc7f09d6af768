"""`calmotion plugins`: list, check, enable, disable and create plugins."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import Command, Commands, file_argument, json_option, plugin_option

if TYPE_CHECKING:
    from calmotion.cli.output import Output


def add_to(commands: Commands) -> None:
    """Add the command."""
    text = "list, check, disable and create plugins"
    plugins = commands.add_parser("plugins", help=text, description=f"{text.capitalize()}.")
    actions = plugins.add_subparsers(title="commands", required=True, metavar="COMMAND")
    listing = actions.add_parser("list", help="list every plugin, its state, its operators and their properties")
    listing.set_defaults(command=_action("list_plugins"))
    plugin_option(listing)
    listing.add_argument("--verbose", action="store_true", help="print the traceback of a plugin that failed")
    check = actions.add_parser("check", help="check manifest, operators and properties of a plugin")
    check.set_defaults(command=_action("check_plugins"))
    file_argument(check, "folder", metavar="DIR", help="folder of the plugin")
    choices = []
    for name, text in (("enable", "load a plugin again"), ("disable", "do not load a plugin any more")):
        choice = actions.add_parser(name, help=text)
        choice.set_defaults(command=_action("choose_plugin"), enabled=name == "enable")
        choice.add_argument("id", metavar="ID", help="id of the plugin, as `calmotion plugins list` shows it")
        plugin_option(choice)
        choices.append(choice)
    new = actions.add_parser("new", help="create a plugin: a folder with an operator, a manifest and a passing test")
    new.set_defaults(command=_action("new_plugin"))
    new.add_argument("name", metavar="NAME", help="id of the plugin: a-z, 0-9 and _")
    file_argument(new, "--folder", metavar="DIR", default=".", help="where the folder NAME is made (default: here)")
    for command in (listing, check, *choices, new):
        json_option(command)


def _action(name: str) -> Command:
    def act(args: argparse.Namespace, output: Output) -> int:
        from calmotion.cli.commands.setup import plugin_actions

        status: int = getattr(plugin_actions, name)(args, output)
        return status

    return act
