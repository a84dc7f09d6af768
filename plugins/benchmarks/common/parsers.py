"""Parsers of the arguments of benchmarks."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence

from calmotion.cli import json_option


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


def shots_argument(parser: argparse.ArgumentParser, shots: Sequence[str]) -> None:
    """The shots that a benchmark runs on.

    Args:
        parser: To which the argument is added.
        shots: Samples that are taken without it.
    """
    names = "the samples" if len(shots) > 2 else " and ".join(shots)
    parser.add_argument("shots", metavar="SHOT", nargs="*", default=list(shots), help=f"USD file (default: {names})")
