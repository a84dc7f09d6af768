"""Formulas as MathML, which browsers show without a script from the network."""

import html
import re

from latex2mathml.converter import convert

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
_TAG = re.compile(r"\\tag\{([^}]*)\}")


def on_page_content(content: str, **_: object) -> str:
    """Replace the formulas of a page."""
    return _FORMULA.sub(_mathml, content)


def _mathml(found: re.Match[str]) -> str:
    latex = html.unescape(found[3])
    number = _TAG.search(latex)
    display = found[2] == "["
    formula = convert(_TAG.sub("", latex).strip(), display="block" if display else "inline")
    if not display:
        return formula
    tag = f'<span style="float: right">({number[1]})</span>' if number else ""
    return f'<div class="formula">{tag}{formula}</div>'
