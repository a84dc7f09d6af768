"""`calmotion cache`: size of the caches, and their removal."""

import argparse
import re
from typing import Any

from calmotion.cli import Output, console_on, json_option, print_table
from calmotion.support.caching.cache_folder import CACHES, cache_folder

EXAMPLES = (("calmotion cache info", "how large are the caches?"),)
ALL = "all"
_UNITS = {"B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9}


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} Their content is made again when it is needed."
    actions = command.add_subparsers(title="commands", required=True, metavar="COMMAND")
    info = actions.add_parser("info", help="print the folder, the number of entries and the size of each cache")
    info.set_defaults(action=_info)
    json_option(info)
    clear = actions.add_parser("clear", help="remove everything in a cache")
    clear.set_defaults(size=0)
    prune = actions.add_parser("prune", help="remove what was not used for the longest time, down to a size")
    prune.add_argument(
        "--size", type=size, metavar="SIZE", help="largest size of each cache, such as 500MB (default: its limit)"
    )
    for action in (clear, prune):
        action.set_defaults(action=_remove)
        action.add_argument(
            "cache", nargs="?", choices=(*CACHES, ALL), default=ALL, metavar="CACHE",
            help=f"{', '.join(CACHES)} or all (default)",
        )  # fmt: skip
        json_option(action)


def size(text: str) -> int:
    """A size such as `500MB` in bytes.

    Raises:
        argparse.ArgumentTypeError: It is none.
    """
    found = re.fullmatch(r"(\d{1,9}(?:\.\d*)?) *([KMG]?B)", text.strip().upper())
    if found is None:
        raise argparse.ArgumentTypeError(f"{text} is not a size; write a number with B, kB, MB or GB, such as 500MB")
    return int(float(found[1]) * _UNITS[found[2]])


def run(args: argparse.Namespace, output: Output) -> int:
    """Do what is asked for."""
    status: int = args.action(args, output)
    return status


def _info(args: argparse.Namespace, output: Output) -> int:
    from calmotion.support.caching.caches import entries

    rows = []
    for name, (_, limit) in CACHES.items():
        found = entries(name)
        total = sum(entry.size for entry in found)
        rows.append({"name": name, "entries": len(found), "size_bytes": total, "limit_bytes": limit})
    if output.json:
        output.object({"folder": str(cache_folder()), "caches": rows})
    else:
        _print(str(cache_folder()), rows, output)
    return 0


def _remove(args: argparse.Namespace, output: Output) -> int:
    from calmotion.support.caching.caches import clear, prune

    rows = []
    for name in CACHES if args.cache == ALL else [args.cache]:
        gone = clear(name) if args.size == 0 else prune(name, args.size)
        rows.append({"name": name, "removed": len(gone), "size_bytes": sum(entry.size for entry in gone)})
    if output.json:
        output.object({"caches": rows})
    else:
        _print("Removed", rows, output)
    return 0


def _print(title: str, rows: list[dict[str, Any]], output: Output) -> None:
    from rich.filesize import decimal

    def shown(key: str, value: Any) -> str:
        return decimal(value) if key.endswith("bytes") else str(value)

    cells = [[CACHES[row["name"]][0], *(shown(key, value) for key, value in row.items())] for row in rows]
    heads = ["cache of", *(key.removesuffix("_bytes") for key in rows[0])]
    print_table(console_on(output.stream), title, heads, cells, texts=2)
