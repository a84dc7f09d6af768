"""The sentences of a page in Markdown, without its code, tables, headings, addresses and formulas; texts of code."""

import ast
import re
from collections.abc import Iterator

NOT_PROSE = re.compile(
    r"^ *```.*?^ *```$|\$\$.*?\$\$|<!--.*?-->"  # blocks of code and formulas, comments
    r"|^(?: {4}|\t|\||#).*?$"  # indented code, tables, headings
    r"|!\[[^\]]*\]\([^)]*\)",  # pictures
    re.DOTALL | re.MULTILINE,
)


def sentences(text: str) -> list[str]:
    """The sentences of a page; code and formulas within one are a single word, X."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", NOT_PROSE.sub("", text))
    text = re.sub(r"`[^`]*`|\$[^$]*\$", "X", text)
    paragraphs = [" ".join(block.split()) for block in re.split(r"\n\s*\n|\n *(?=[-*] |\d+\. )", text)]
    return [sentence for block in paragraphs for sentence in re.split(r"(?<=[.!?:;])\s+", block) if sentence]


def sentences_through_code(text: str) -> list[str]:
    """Words before a block of code that do not end there, and words behind one that do not begin a sentence."""
    text = re.sub(r"^#.*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^```.*?^```$", "    code\n", text, flags=re.DOTALL | re.MULTILINE)
    blocks = re.split(r"\n\s*\n", text)
    code = [all(line.startswith("    ") for line in block.splitlines() if line) for block in blocks]
    found = []
    for block, is_code, then, then_code in zip(blocks, code, blocks[1:], code[1:], strict=False):
        if then_code and not is_code and not re.search(r"[.:?!)*|>]\s*$", block):
            found.append(block[-80:])
        if is_code and not then_code and re.match(r"[a-z]", then):
            found.append(then[:80])
    return found


SENTENCE = re.compile(r"\w+(?: [\w()/'-]+,?){3}")  # four words in a row: no key, path, pattern or markup


def messages(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Texts of a module that may be sentences for people, with their lines: those that are no docstrings, and hold no
    markup. Values that are filled in are a word, X."""
    skipped = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            skipped |= {id(part) for part in ast.walk(node) if part is not node}
        elif isinstance(node, ast.Attribute) and node.attr == "split":  # a list of words
            skipped.add(id(node.value))
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.JoinedStr):
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "X" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        else:
            continue
        if SENTENCE.search(text) and "<" not in text and "\n" not in text:
            yield node.lineno, text
