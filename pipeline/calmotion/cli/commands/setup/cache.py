"""`calmotion cache`: size of the caches, and their removal."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli.options import json_option
from calmotion.support.caching.cache_folder import CACHES, cache_folder

if TYPE_CHECKING:
    from calmotion.cli.output import Output
    from calmotion.support.caching.caches import Entry

ALL = "all"
_UNITS = {"B": 1, "kB": 10**3, "MB": 10**6, "GB": 10**9}

EXAMPLES = (("calmotion cache info", "how large are the caches?"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} All that is in them is made again when it is needed."
    actions = command.add_subparsers(title="commands", required=True, metavar="COMMAND")
    info = actions.add_parser("info", help="print the folder, the number of entries and the size of each cache")
    clear = actions.add_parser("clear", help="remove everything in a cache")
    prune = actions.add_parser("prune", help="remove what was not used for the longest time, down to a size")
    prune.add_argument(
        "--size", type=size, metavar="SIZE", help="largest size of each cache, such as 500MB (default: its limit)"
    )
    for action in (clear, prune):
        action.add_argument(
            "cache", nargs="?", choices=(*CACHES, ALL), default=ALL, metavar="CACHE",
            help=f"{', '.join(CACHES)} or all (default)",
        )  # fmt: skip
    for action, act in ((info, _info), (clear, _clear), (prune, _prune)):
        json_option(action)
        action.set_defaults(action=act)


def run(args: argparse.Namespace, output: Output) -> int:
    """Do what is asked for."""
    status: int = args.action(args, output)
    return status


def size(text: str) -> int:
    """A size such as `500MB` in bytes.

    Raises:
        argparse.ArgumentTypeError: It is none.
    """
    for unit in sorted(_UNITS, key=len, reverse=True):
        if text.lower().endswith(unit.lower()):
            try:
                value = float(text[: -len(unit)])
            except ValueError:
                break
            if 0.0 <= value < 1e9:
                return int(value * _UNITS[unit])
    raise argparse.ArgumentTypeError(f"{text} is not a size; write a number with {', '.join(_UNITS)}, such as 500MB")


def readable(count: int) -> str:
    """A number of bytes with its unit."""
    unit = next((name for name in ("GB", "MB", "kB") if count >= _UNITS[name]), "B")
    return f"{count} B" if unit == "B" else f"{count / _UNITS[unit]:.1f} {unit}"


def _info(args: argparse.Namespace, output: Output) -> int:
    from calmotion.support.caching.caches import entries

    rows: list[dict[str, Any]] = []
    for name, (_, limit) in CACHES.items():
        found = entries(name)
        total = sum(entry.size for entry in found)
        rows.append({"name": name, "entries": len(found), "size_bytes": total, "limit_bytes": limit})
    if output.json:
        output.object({"folder": str(cache_folder()), "caches": rows})
        return 0
    print(cache_folder(), file=output.stream)
    for row in rows:
        print(
            f"  {row['name']:12}{CACHES[row['name']][0]}: {_count(row['entries'])}, "
            f"{readable(row['size_bytes'])} of at most {readable(row['limit_bytes'])}",
            file=output.stream,
        )
    return 0


def _clear(args: argparse.Namespace, output: Output) -> int:
    from calmotion.support.caching.caches import clear

    return _tell(args, output, {name: clear(name) for name in _chosen(args)})


def _prune(args: argparse.Namespace, output: Output) -> int:
    from calmotion.support.caching.caches import prune

    return _tell(args, output, {name: prune(name, args.size) for name in _chosen(args)})


def _chosen(args: argparse.Namespace) -> list[str]:
    return list(CACHES) if args.cache == ALL else [args.cache]


def _count(entries: int) -> str:
    return f"{entries} {'entry' if entries == 1 else 'entries'}"


def _tell(args: argparse.Namespace, output: Output, removed: dict[str, list[Entry]]) -> int:
    """Print what was removed."""
    rows: list[dict[str, Any]] = [
        {"name": name, "removed": len(gone), "size_bytes": sum(entry.size for entry in gone)}
        for name, gone in removed.items()
    ]
    if output.json:
        output.object({"caches": rows})
        return 0
    for row in rows:
        print(f"{row['name']}: removed {_count(row['removed'])}, {readable(row['size_bytes'])}", file=output.stream)
    return 0
