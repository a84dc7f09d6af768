"""`calmotion plugins`: list, check, enable, disable and create plugins."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calmotion.cli import Output, json_option, plugin_option

if TYPE_CHECKING:
    from calmotion.host import Operator, Plugin


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    actions = command.add_subparsers(title="commands", required=True, metavar="COMMAND")
    listing = actions.add_parser("list", help="list every plugin, its state, its operators and their properties")
    listing.set_defaults(action=list_plugins)
    plugin_option(listing)
    listing.add_argument("--verbose", action="store_true", help="print the traceback of a plugin that failed")
    check = actions.add_parser("check", help="check manifest, operators and properties of a plugin")
    check.set_defaults(action=check_plugins)
    check.add_argument("folder", metavar="DIR", help="folder of the plugin")
    choices = []
    for name, text in (("enable", "load a plugin again"), ("disable", "do not load a plugin any more")):
        choice = actions.add_parser(name, help=text)
        choice.set_defaults(action=choose_plugin, enabled=name == "enable")
        choice.add_argument("id", metavar="ID", help="id of the plugin, as `calmotion plugins list` shows it")
        plugin_option(choice)
        choices.append(choice)
    new = actions.add_parser("new", help="create a plugin: a folder with an operator, a manifest and a passing test")
    new.set_defaults(action=new_plugin)
    new.add_argument("name", metavar="NAME", help="id of the plugin: a-z, 0-9 and _")
    new.add_argument("--folder", metavar="DIR", default=".", help="where the folder NAME is made (default: here)")
    for action in (listing, check, *choices, new):
        json_option(action)


def run(args: argparse.Namespace, output: Output) -> int:
    """Do what is asked for."""
    status: int = args.action(args, output)
    return status


def list_plugins(args: argparse.Namespace, output: Output) -> int:
    """Print every plugin with its state, operators and properties; the exit status is 0 also when some failed."""
    from calmotion.host import open_host

    plugins = open_host(args.plugins).plugins
    if output.json:
        output.object({"plugins": [_plugin(plugin) for plugin in plugins]})
        return 0
    for plugin in plugins:
        _print_plugin(plugin, output, args.verbose)
    if not plugins:
        print("no plugin was found", file=output.stream)
    return 0


def _plugin(plugin: Plugin) -> dict[str, Any]:
    manifest = plugin.manifest
    return {
        "id": plugin.id,
        "version": manifest.version if manifest else None,
        "name": manifest.name if manifest else None,
        "tagline": manifest.tagline if manifest else None,
        "license": manifest.license if manifest else None,
        "tags": manifest.tags if manifest else [],
        "folder": str(plugin.location.folder),
        "origin": plugin.location.origin,
        "state": str(plugin.state),
        "error": str(plugin.error) if plugin.error else None,
        "traceback": plugin.traceback or None,
        "commands": [{"name": entry.name, "help": entry.help} for entry in manifest.commands] if manifest else [],
        "operators": [_operator(cls) for cls in plugin.operators],
    }


def _operator(cls: type[Operator]) -> dict[str, Any]:
    return {
        "idname": cls.idname,
        "label": cls.label,
        "requires": [kind.__name__ for kind in cls.requires],
        "uses": [kind.__name__ for kind in cls.uses],
        "provides": [kind.__name__ for kind in cls.provides],
        "properties": [
            {
                "name": f"{cls.idname}.{declared.name}",
                "type": declared.kind.__name__,
                "default": declared.default,
                "unit": declared.unit,
                "minimum": declared.minimum,
                "maximum": declared.maximum,
                "choices": declared.choices,
                "description": declared.description,
            }
            for declared in cls.properties
        ],
    }


def _print_plugin(plugin: Plugin, output: Output, verbose: bool) -> None:
    from calmotion.cli.parser import property_text
    from calmotion.cli.tables import filled

    def tell(line: str) -> None:
        print(filled(line, output.stream, " " * 8), file=output.stream)

    manifest = plugin.manifest
    version = f" {manifest.version}" if manifest else ""
    tell(f"{plugin.id}{version}: {plugin.state} ({plugin.location.origin})")
    if manifest:
        tell(f"    {manifest.tagline}")
    if plugin.error:
        tell(f"    {type(plugin.error).__name__}: {plugin.error}")
        if verbose:
            tell("".join(f"    | {line}\n" for line in plugin.traceback.splitlines()).rstrip())
    for entry in manifest.commands if manifest else ():
        tell(f"    calmotion {entry.name}  {entry.help}")
    for cls in plugin.operators:
        inputs = ", ".join([k.__name__ for k in cls.requires] + [f"[{k.__name__}]" for k in cls.uses])
        tell(f"    {cls.idname}  {cls.label}: {inputs} -> {', '.join(k.__name__ for k in cls.provides)}")
        for declared in cls.properties:
            tell(f"        {property_text(cls.idname, declared)}")


def check_plugins(args: argparse.Namespace, output: Output) -> int:
    """Check the plugin in a folder; exit status 1 when it breaks a rule."""
    from calmotion.testing import check_plugin

    problems = check_plugin(Path(args.folder)) + _taken_names(Path(args.folder))
    if output.json:
        output.object({"folder": args.folder, "problems": problems})
    else:
        for problem in problems:
            print(f"{args.folder}: {problem}", file=output.stream)
        if not problems:
            print(f"{args.folder}: OK", file=output.stream)
    return 1 if problems else 0


def _taken_names(folder: Path) -> list[str]:
    """The commands of a plugin that the engine has under the same names."""
    from calmotion.cli.commands.table import BUILT_IN
    from calmotion.host import PluginError, read_manifest

    try:
        commands = read_manifest(folder.resolve()).commands
    except PluginError:  # it is among the other problems
        return []
    return [f"the command {one.name} is built in; choose another name" for one in commands if one.name in BUILT_IN]


def choose_plugin(args: argparse.Namespace, output: Output) -> int:
    """Enable or disable a plugin for all later runs.

    Raises:
        SettingError: There is no plugin of this id, or the choice cannot be saved.
    """
    from calmotion.host import SettingError, nearest, open_host
    from calmotion.host.settings import choose, disabled_plugins

    if args.id not in disabled_plugins():
        known = [plugin.id for plugin in open_host(args.plugins).plugins]
        if args.id not in known:
            raise SettingError(
                "there is no such plugin",
                path="ID",
                found=args.id,
                remedy=f"{nearest(args.id, known)}The plugins are {', '.join(known)}.",
            )
    file = choose(args.id, args.enabled)
    state = "enabled" if args.enabled else "disabled"
    if output.json:
        output.object({"id": args.id, "state": state, "file": str(file)})
    else:
        print(f"{args.id} is {state} (saved in {file})", file=output.stream)
    return 0


def new_plugin(args: argparse.Namespace, output: Output) -> int:
    """Create a plugin.

    Raises:
        PluginError: The name is not valid, or the folder exists already.
    """
    from calmotion.host.template import write_template

    folder = write_template(args.name, Path(args.folder))
    if output.json:
        output.object({"id": args.name, "folder": str(folder)})
        return 0
    print(f"created {folder}; next steps:", file=output.stream)
    for line in (f"pip install -e {folder}", f"pytest {folder}", f"calmotion plugins check {folder / args.name}"):
        print(f"    {line}", file=output.stream)
    return 0
