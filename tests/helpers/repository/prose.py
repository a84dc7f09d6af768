"""The sentences of a page in Markdown, without its code, tables, headings, addresses and formulas."""

import re

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
