"""Parsers of the arguments of benchmarks."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence

from calmotion.benchmarks.common.shots import MADE
from calmotion.cli.options import json_option, quantity


class _Paragraphs(argparse.HelpFormatter):
    """Wraps each paragraph and each item of a description on its own."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs = re.split(r"\n\s*\n|\n(?=- )", text.strip())
        return "\n".join(super(_Paragraphs, self)._fill_text(part, width, indent) for part in paragraphs)


def bench_parser(name: str, description: str | None) -> argparse.ArgumentParser:
    """A parser for the arguments of a benchmark; its description may have several paragraphs."""
    return argparse.ArgumentParser(prog=f"calmotion bench {name}", description=description, formatter_class=_Paragraphs)


def output_options(parser: argparse.ArgumentParser, csv: str | None = None, markdown: bool = False) -> None:
    """The options for what a benchmark prints and writes: --json, and --csv and --markdown where it has a table.

    Args:
        parser: To which they are added.
        csv: What the CSV file contains; None: there is none.
        markdown: Whether the table can be written as Markdown.
    """
    json_option(parser)
    if csv is not None:
        parser.add_argument("--csv", metavar="FILE", help=f"also write {csv}")
    if markdown:
        parser.add_argument("--markdown", metavar="FILE", help="also write the table as Markdown")


def links_parser(name: str, description: str | None) -> argparse.ArgumentParser:
    """The arguments of a benchmark on links, as `scenes.links.read_links` takes them."""
    parser = bench_parser(name, description)
    parser.add_argument("links", nargs="+", metavar="FILE[:PRIM]", help="links; all bodies without a prim")
    return parser


def shots_parser(name: str, description: str | None) -> argparse.ArgumentParser:
    """The arguments of a benchmark that runs on shots, or on the synthetic ones of `MADE`."""
    made = "; ".join(f"{shot}: {text}" for shot, text in MADE.items())
    parser = bench_parser(name, description)
    parser.add_argument(
        "shots", metavar="SHOT", nargs="*", default=["arm", "linkage"],
        help=f"USD file, or a synthetic shot ({made}); default: arm linkage",
    )  # fmt: skip
    output_options(parser)
    return parser


def table_parser(
    name: str, description: str | None, shots: Sequence[str], tolerances: Sequence[float]
) -> argparse.ArgumentParser:
    """The arguments of a benchmark that simulates shots with several tolerances and prints a table."""
    parser = bench_parser(name, description)
    parser.add_argument("shots", metavar="SHOT", nargs="*", default=list(shots), help="USD file (default: samples)")
    parser.add_argument(
        "--tolerances", metavar="LENGTH", nargs="+", type=quantity("m", positive=True), default=list(tolerances)
    )
    output_options(parser, csv="a table", markdown=True)
    return parser
