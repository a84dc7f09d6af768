"""Where cells of tables may be broken: names behind their signs, numbers and units never."""

import re

_CELL = re.compile(r"<td[^>]*>.*?</td>", re.DOTALL)
_NAME = re.compile(r"(?<=<code>)[^<]+")
_QUANTITY = re.compile(r"(?<=\d) (?=(?:mm|ms|s|Hz|GB|MB|kg|deg)\b)")


def on_page_content(content: str, **_: object) -> str:
    """Add these places to the tables of a page."""
    return _CELL.sub(_broken, content)


def _broken(cell: re.Match[str]) -> str:
    named = _NAME.sub(lambda name: re.sub(r"(?<=[:/_.])(?=\w)", "<wbr>", name[0]), cell[0])
    return _QUANTITY.sub("\N{NO-BREAK SPACE}", named)
