"""`calmotion materials`: the table of materials for flexible links."""

import argparse
from dataclasses import asdict
from typing import Any

from calmotion.cli import Output, console_on, json_option, print_table, say

EXAMPLES = (("calmotion materials abs", "one material, with its source"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.add_argument("name", nargs="?", metavar="NAME", help="show only this material, with its source")
    command.add_argument(
        "--materials",
        metavar="FILE",
        action="append",
        default=[],
        help="TOML file with more materials; may be repeated",
    )
    json_option(command)
    command.add_argument("--toml", action="store_true", help="print TOML, to be changed and used with --materials")


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.catalogs.materials import known_materials, material_named

    known = known_materials(args.materials)
    if args.name:
        known = dict([material_named(args.name, known)])
    rows = {name: asdict(material) for name, material in known.items()}
    if args.json:
        output.object({"command": "materials", "materials": rows})
    elif args.toml:
        print("\n".join(_as_toml(name, row) for name, row in rows.items()), file=output.stream, end="")
    else:
        _print(rows, bool(args.name), output)
    return 0


def _as_toml(name: str, row: dict[str, Any]) -> str:
    import json

    values = row | {"youngs_modulus": row["youngs_modulus"] / 1e9, "aliases": list(row["aliases"])}
    return f"[{name}]\n" + "".join(
        f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items()
    )


def _print(rows: dict[str, dict[str, Any]], sources: bool, output: Output) -> None:
    console = console_on(output.stream)
    cells = [
        [
            ", ".join([name, *row["aliases"]]), row["title"], row["group"], f"{row['youngs_modulus'] / 1e9:.4g}",
            f"{row['poissons_ratio']:.3g}", f"{row['density']:.4g}", f"{row['damping_ratio']:.3g}",
        ]
        for name, row in rows.items()
    ]  # fmt: skip
    heads = ["name", "material", "kind", "modulus GPa", "Poisson's ratio", "density kg/m³", "damping ratio"]
    print_table(console, "Materials", heads, cells, texts=3)
    for row in rows.values() if sources else ():
        say(console, f"source: {row['source']}")
