"""The page: the template with the words of the report, and the data of its charts and its scene."""

import json
import re
import zipfile
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError, file_access
from calmotion.model import PageContent, Section, TextTable
from calmotion.support import write_text
from matplotlib.figure import Figure

from .charts import charts_of

TEMPLATE = Path(__file__).with_name("template.html")


def write_page(
    path: str, content: PageContent, plots: Sequence[tuple[str, Figure]], scene: dict[str, Any] | None
) -> str:
    """Write a page; returns its path.

    Args:
        path: File to write.
        content: Words and provenance.
        plots: Figures of curves under their headings.
        scene: Of the 3D player, see `scene_of`; None for a page without one.

    Raises:
        ShotError: The file cannot be written.
    """
    text = page_of(content, plots, scene)
    with file_access("the page cannot be written", path, "Choose another --html."):
        write_text(Path(path), text)
    return path


def page_of(content: PageContent, plots: Sequence[tuple[str, Figure]], scene: dict[str, Any] | None) -> str:
    """The text of a page."""
    first, *others = content.sections or (Section("", ()),)
    said = [part for part in first.parts if isinstance(part, str)]
    tables = Section("Result in numbers", tuple(p for p in first.parts if isinstance(p, TextTable)))
    sections = [section for section in (tables, *others) if section.parts]
    charts, arrays = charts_of(plots), {}
    for name, data in (("scene", scene), ("charts", charts)):
        arrays[name] = "" if data is None else data["arrays"]
    data = {
        "scene": None if scene is None else {key: value for key, value in scene.items() if key != "arrays"},
        "charts": charts["groups"],
    }
    parts = {
        "title": escape(content.title),
        "version": escape(str(content.provenance.get("versions", {}).get("calmotion", ""))),
        "verdict": "".join(map(_paragraph, said)),
        "sections": "".join(_section(section) for section in sections),
        "provenance": _provenance(content.provenance),
        "data": json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/"),
        "scene": arrays["scene"],
        "charts": arrays["charts"],
        "three": three() if scene else "",
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], TEMPLATE.read_text(encoding="utf-8"))


@cache
def three() -> str:
    """The text of three.js (MIT), as the viewer of trimesh has it.

    Raises:
        ShotError: This version of trimesh has none.
    """
    import trimesh

    archive = Path(trimesh.__file__).parent / "resources" / "templates" / "viewer.zip"
    try:
        with zipfile.ZipFile(archive) as files:
            viewer = files.read(files.namelist()[0]).decode("utf-8")
    except (OSError, zipfile.BadZipFile, IndexError):
        viewer = ""
    begin = viewer.find("<script>")
    end = re.compile(r'Object\.defineProperty\(\w+,"__esModule",\{value:!0\}\)\}\)+;').search(viewer, max(begin, 0))
    if begin < 0 or end is None:
        raise ShotError(
            "trimesh has no viewer with three.js",
            path="--html",
            found=f"trimesh {trimesh.__version__}",
            remedy="Install another version: pip install 'trimesh>=4.11,<6'",
        )
    return viewer[begin + len("<script>") : end.end()]


def _section(section: Section) -> str:
    parts = "".join(_table(part) if isinstance(part, TextTable) else _paragraph(part) for part in section.parts)
    return f"<section><h2>{escape(section.title)}</h2>{parts}</section>"


def _paragraph(text: str) -> str:
    """A line of a report as a sentence; below the heading of the simplifications, their mark says nothing."""
    text = text.removeprefix("simplified: ")
    first = text.split(" ", 1)[0].rstrip(",")  # a name with a colon stays as it is
    text = text[:1].upper() + text[1:] if first.isalpha() and first.islower() else text
    return f"<p>{_divisible(text if text.endswith(('.', '!', '?')) else text + '.', '/')}</p>"


def _table(table: TextTable) -> str:
    columns = [[row[n] for row in table.rows] for n in range(len(table.columns))]
    kinds = ["text" if n < table.texts or _has_words(cells) else "number" for n, cells in enumerate(columns)]
    kinds = ["hash" if column == "SHA-256" else kind for kind, column in zip(kinds, table.columns, strict=True)]
    head = "".join(f'<th class="{kind}">{escape(cell)}</th>' for kind, cell in zip(kinds, table.columns, strict=True))
    divided = [zip(kinds, map(_divisible, row), strict=True) for row in table.rows]
    rows = "".join("<tr>" + "".join(f'<td class="{k}">{cell}</td>' for k, cell in row) + "</tr>" for row in divided)
    title = escape(table.title)  # beside the part that scrolls on a narrow screen
    body = f'<table aria-label="{title}"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    return f'<h3>{title}</h3><div class="wide">{body}</div>'


def _divisible(text: str, marks: str = "/._") -> str:
    """Text whose paths a narrow screen breaks after slashes, and names in cells after dots and underscores."""
    return re.sub(rf"(?<=[^\d\s])([{marks}])(?=\w)", r"\g<0><wbr>", escape(text))


def _has_words(cells: Sequence[str]) -> bool:
    """Whether a column has other things than numbers with units."""
    return any(cell[:1].isalpha() or cell[:1] == "/" for cell in cells)


def _provenance(origin: Mapping[str, Any]) -> str:
    """Command, time, inputs with their hashes, versions and settings."""
    lines = []
    if command := origin.get("command"):
        lines.append(f"<p>Command: <code>{escape(command)}</code></p>")
    if created := origin.get("created"):
        when = datetime.fromisoformat(created).astimezone(UTC)
        lines.append(f"<p>Made: {when:%Y-%m-%d %H:%M} UTC</p>")
    if inputs := origin.get("inputs"):
        rows = tuple((row["role"], row["path"], row["sha256"]) for row in inputs)
        lines.append(_table(TextTable("Inputs", ("input", "file", "SHA-256"), rows, texts=3)))
    if versions := origin.get("versions"):
        named = tuple((name, str(number)) for name, number in versions.items())
        lines.append(_table(TextTable("Versions", ("program", "version"), named, texts=2)))
    if settings := origin.get("settings"):
        shown = json.dumps(settings, indent=2, default=str)
        lines.append(f"<details><summary>Settings</summary><pre>{escape(shown)}</pre></details>")
    return "".join(lines)
