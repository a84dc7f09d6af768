"""The words of a page of `--html`: what reports print, kept in parts."""

import io
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich.console import Console

from calmotion.cli.tables import counted, with_texts
from calmotion.host import Host
from calmotion.model.outputs import PageContent, Section, TextTable
from calmotion.support.naming import as_written
from calmotion.workflow import outputs
from calmotion.workflow.manifest import origin_of, origin_of_run
from calmotion.workflow.results import SimulationResult

NAMED = 3  # files in a title
Printed = Mapping[str, Callable[[dict[str, Any], Console], None]]


class Collected(Console):
    """A console that keeps what `say` and `print_table` give it.

    Attributes:
        parts: Sentences and tables in their order.
    """

    def __init__(self) -> None:
        super().__init__(file=io.StringIO())
        self.parts: list[str | TextTable] = []


def sections_of(report: Mapping[str, Any], printed: Printed) -> tuple[Section, ...]:
    """Sections of a page, by their headings: each has what its function prints of a report; those without are missing.

    Args:
        report: The object of `--json`.
        printed: A function for each heading.
    """
    names = report.get("written_names", {})
    shown = with_texts(dict(report), lambda text: as_written(text, names))
    sections = []
    for title, write in printed.items():
        console = Collected()
        write(shown, console)
        if console.parts:
            sections.append(Section(title, tuple(console.parts)))
    return tuple(sections)


def write_page(result: SimulationResult, path: str | os.PathLike[str]) -> str:
    """Write a result as one page for browsers, as `--html` does: the report, its curves, and the motions in 3D.

    Returns:
        The path.

    Raises:
        ShotError: It cannot be written, or the shot is read from this file.
    """
    from calmotion.cli.reports.run import SECTIONS

    report = result.report()
    title = f"{report['command']} {os.path.basename(result.shot.path)}"
    return result.write_page(path, PageContent(title, sections_of(report, SECTIONS), origin_of_run(result)))


def page_of_report(
    host: Host, path: str | None, report: Mapping[str, Any], printed: Printed, inputs: Mapping[str, str],
    plots: Sequence[tuple[str, Any]] = (),
) -> str | None:  # fmt: skip
    """Write the page of a report without a motion; its path, or None where no page is requested.

    Args:
        host: With the plugin that writes pages.
        path: Of the page, or None.
        report: The object of `--json`.
        printed: As of `sections_of`.
        inputs: Files that were read, by what they are.
        plots: Figures under their headings.
    """
    if path is None:
        return None
    names = [os.path.basename(name) for name in inputs.values()]
    more = f" and {counted(len(names) - NAMED, 'more file')}" if len(names) > NAMED else ""
    title = f"{report['command']} {', '.join(names[:NAMED])}{more}"
    content = PageContent(title, sections_of(report, printed), origin_of(inputs), tuple(plots))
    return outputs.write_page(host, path, content)
