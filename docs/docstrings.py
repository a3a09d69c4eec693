"""Docstrings for the site: the house's NumPy style, in the form that griffe takes.

The house writes what a parameter is beside its name, its type being in the signature, and lets a paragraph follow a section:

    Parameters
    ----------
    n : number of discs,
        at least 3.

    Any consistent unit system may be used.

griffe takes what is beside a name for its type, and paragraphs only before the first section:

    Any consistent unit system may be used.

    Parameters
    ----------
    n
        number of discs,
        at least 3.

Then the types come from the signature, and a name that is not in it is an error of the strict build.
"""

import re
from typing import Any

from griffe import Extension, Object

SECTION = re.compile(r"(Parameters|Attributes|Returns|Raises)\n-+$")


def translate(text: str) -> str:
    """A docstring, dedented, as griffe takes it."""
    before: list[str] = []
    sections: list[str] = []
    section = ""
    for block in re.split(r"\n\s*\n", text):
        head, _, body = block.partition("\n")
        rule, _, rest = body.partition("\n")
        if SECTION.fullmatch(f"{head}\n{rule}"):
            section = head
            sections.append(f"{head}\n{rule}\n{items(head, rest)}")
        elif section in ("Parameters", "Attributes", "Raises") and re.match(r"\w[\w, ]* : ", block):
            sections.append(items(section, block))
        else:
            before.append(block)
    return "\n\n".join(before + sections)


def items(section: str, lines: str) -> str:
    """Items `name : text` with the text below the name; what is returned has no name."""
    if section == "Returns":
        lines = f"@ : {lines}"
    heads = re.sub(r"^([\w@]+(?:, \w+)*) : ", r"\1\n    ", lines, flags=re.MULTILINE)
    return heads.replace("@\n", ":\n", 1) if section == "Returns" else heads


def literal(text: str) -> str:
    """Stars between two characters, powers and products, kept from being read as emphasis; but not in code."""
    code = re.compile(r"(`[^`]*`|\n\n {4}(?:.+\n?)+)")  # indented code begins after an empty line
    return "".join(part if i % 2 else re.sub(r"(?<=[^\s*])\*+(?=[\w(])", stars, part) for i, part in enumerate(code.split(text)))


def stars(found: re.Match) -> str:
    return found[0].replace("*", r"\*")


class Docstrings(Extension):
    """Translates each docstring when its object is read."""

    def on_instance(self, *, obj: Object, **kwargs: Any) -> None:
        if obj.docstring:
            obj.docstring.value = translate(literal(obj.docstring.value))
