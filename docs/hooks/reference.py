"""Pages of the reference that are made of the sources: schemas, commands, Python interface."""

from __future__ import annotations

import importlib
import inspect
import os
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages."""
    sys.path.insert(0, str(ROOT / "pipeline"))
    pages = {"schemas": schemas(), "commands": commands(), "python": python_interface()}
    for name, content in pages.items():
        files.append(File.generated(config, f"reference/{name}.md", content=content))
    for video in sorted(ROOT.glob("samples/*/*.webp")):
        files.append(File.generated(config, f"images/{video.name}", abs_src_path=str(video)))
    return files


def schemas() -> str:
    """The attributes of the schemas, from the file that USD generates them of."""
    from pxr import Sdf

    layer = Sdf.Layer.FindOrOpen(str(ROOT / "usd_schemas" / "calmotion" / "schema.usda"))
    folder = ROOT / "docs" / "reference"
    use = tomllib.loads((folder / "schema_use.toml").read_text())
    lines = ["# Schemas", "", (folder / "schemas_head.txt").read_text().strip(), ""]
    for prim in layer.rootPrims:
        if not prim.name.startswith("Calm"):
            continue
        lines += [f"## {prim.name}", "", plain(prim.documentation), ""]
        lines += ["| attribute | type | unit | default | meaning | when to set it |"]
        lines += ["| --- | --- | --- | --- | --- | --- |"]
        for attribute in prim.attributes:
            lines.append(schema_row(attribute, use.get(attribute.name, {})))
        for relationship in prim.relationships:
            lines.append(f"| `{relationship.name}` | relationship | | | {cell(relationship.documentation)} | |")
        lines.append("")
    return "\n".join(lines)


def schema_row(attribute: Any, use: dict[str, str]) -> str:
    """One attribute of a schema, with its unit and when to set it."""
    default = attribute.default
    if isinstance(default, float):
        default = f"{default:.6g}"
    shown = "" if default is None else f"`{default}`"
    meaning = cell(attribute.documentation)
    tokens = attribute.GetInfo("allowedTokens") if attribute.HasInfo("allowedTokens") else ()
    if tokens:
        meaning += " One of " + ", ".join(f"`{token}`" for token in tokens) + "."
    unit, when = use.get("unit", ""), cell(use.get("use", ""))
    return f"| `{attribute.name}` | {attribute.typeName} | {unit} | {shown} | {meaning} | {when} |"


def plain(text: str) -> str:
    """A text of several lines on one."""
    return " ".join(text.split())


def cell(text: str) -> str:
    """The same for a cell of a table."""
    return plain(text).replace("|", "\\|")


def commands() -> str:
    """The help of each command, as it is printed."""
    from calmotion.cli.main import build_parser

    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = "100"
    try:
        parser = build_parser()
        lines = ["# Commands", "", "What `calmotion --help` and `calmotion COMMAND --help` print.", ""]
        lines += ["```text", parser.format_help().rstrip(), "```", ""]
        for name, command in subcommands(parser):
            lines += [f"## calmotion {name}", "", "```text", command.format_help().rstrip(), "```", ""]
            for action, inner in subcommands(command):
                lines += [f"### calmotion {name} {action}", "", "```text", inner.format_help().rstrip(), "```", ""]
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before
    return "\n".join(lines)


def subcommands(parser: Any) -> list[tuple[str, Any]]:
    """The commands of a parser by name."""
    return [
        (name, command)
        for action in parser._actions
        if type(action).__name__ == "_SubParsersAction"
        for name, command in action.choices.items()
    ]


def python_interface() -> str:
    """Signatures and docstrings of what `calmotion` and the bundled plugins export."""
    import calmotion

    lines = [
        "# Python interface",
        "",
        "`import calmotion as cm`. The [tutorial](../tutorial_python.md) shows it at work.",
        "",
    ]
    for title, kind in (("Functions", inspect.isfunction), ("Classes", inspect.isclass)):
        lines += [f"## {title}", ""]
        for name in calmotion.__all__:
            if kind(thing := getattr(calmotion, name)):
                lines += entry(name, thing, 3)
    for plugin in sorted((ROOT / "plugins").glob("*/plugin.toml")):
        lines += plugin_interface(plugin.parent.name)
    return "\n".join(lines)


def plugin_interface(plugin: str) -> list[str]:
    """What `calmotion_plugins.PLUGIN` offers besides its operators."""
    from calmotion.host import Operator

    module = importlib.import_module(f"calmotion_plugins.{plugin}")
    lines = []
    for name in getattr(module, "__all__", ()):
        thing = getattr(module, name)
        operator = inspect.isclass(thing) and issubclass(thing, Operator)
        if callable(thing) and name not in ("register", "unregister") and not operator:
            lines += entry(name, thing, 3)
    return [f"## calmotion_plugins.{plugin}", "", *lines] if lines else []


def entry(name: str, thing: Any, level: int) -> list[str]:
    """A function or class with its docstring; of a class its public methods and properties as well."""
    if isinstance(thing, property):
        lines = [f"{'#' * level} {name}", "", "Property.", ""]
    else:
        lines = [f"{'#' * level} {name}", "", "```python", f"{name}{signature(thing)}", "```", ""]
    text = inspect.getdoc(thing) or ""
    lines += ["```text", text, "```", ""] if text else []
    if inspect.isclass(thing):
        for member, value in vars(thing).items():
            public = not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property))
            if public:
                lines += entry(f"{name}.{member}", value, level + 1)
    return lines


def signature(thing: Any) -> str:
    """Arguments without the quotes of annotations that are not evaluated."""
    try:
        return re.sub(r"'([^']*)'", r"\1", str(inspect.signature(thing)))
    except (TypeError, ValueError):
        return "(...)"
