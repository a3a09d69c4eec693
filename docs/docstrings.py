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

Formulas stand in paragraphs of their own, indented by four spaces, in letters that `help` shows well:

    rho r.. = -K r'''' + lambda,   V = sum_i K/2 |r''_i|^2

A point is a derivative with respect to time, " . " a product of vectors. They become TeX. Tables and matrices stay as they are.
"""

import re
from typing import Any

from griffe import Extension, Object

LETTERS = "alpha beta gamma delta zeta eta theta kappa lambda mu nu xi pi rho sigma tau chi psi omega vartheta"
LETTERS += " Gamma Lambda Phi Omega Theta sin cos tan sinh cosh tanh max log arg sum int"
TEX = {name: rf"\{name}" for name in LETTERS.split()}
TEX |= {name: rf"\operatorname{{{name}}}" for name in ("Re", "Im", "diag", "conj", "sech", "asinh", "sinc", "gd", "gap")}
TEX |= {"grad": r"\nabla", "epsilon": r"\varepsilon", "phi": r"\varphi"}
SIGNS = {"...": r"\dots ", "**": "^", "->": r"\to ", ">=": r"\ge ", "<=": r"\le ", "+-": r"\pm ", " ^ ": r" \wedge "}
DERIVATIVE = {"": "{}", ".": r"\dot{{{}}}", "..": r"\ddot{{{}}}"}
WORD = re.compile(rf"(?<![\w_])(?!(?:{'|'.join(TEX)})\b)[A-Za-z]{{3,}}")
FORMULA = re.compile(r"(?<=\n\n)(?: {4}.*(?:\n|$))+")
PART = re.compile(
    r"""(?P<name>[A-Za-z]+) (?P<early>\.{1,2}(?![A-Za-z0-9(.|]))? (?P<prime>'*)
        (?P<below>_(?:\{[^}]*\}|[a-z]+,[a-z](?=[ ]=)|[A-Za-z]+|\d+))? (?P<more>'*) (?P<late>\.{1,2}(?![\w(.|]))?
      | (?P<sign>\.\.\.|\*\*|->|>=|<=|\+-|[ ]\^[ ]) | \^(?P<power>-?\d+|[A-Za-z]{2,}|T\b) | (?P<index>_[A-Za-z]+)
      | (?P<whole>(?<=\))\.(?=[ ]=)) | (?P<times>[ ]?\.[ ]?(?=[\w(|-])) | (?P<gap>[ ]{2,})""",
    re.VERBOSE,
)
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


def formulas(text: str) -> str:
    """A docstring with its formulas in TeX."""
    return FORMULA.sub(lambda found: f"$$\n{display(found[0])}\n$$\n" if is_formula(found[0]) else found[0], text)


def is_formula(block: str) -> bool:
    """Neither code nor a table nor a matrix: each line has few words, and a relation or a sum."""
    lines = block.strip("\n").splitlines()
    formal = all(re.search(r"=|->|\bint |\bsum|[+-] ", line) and len(WORD.findall(line)) < 8 for line in lines)
    return formal and not re.search(r'["`#]|^\s*\[|\w+ :', block, re.MULTILINE)


def display(block: str) -> str:
    """A formula, indented, of one line or more."""
    block = block.rstrip()
    each = [(r"\qquad " if line[4] == " " else "") + tex(line.strip()) for line in block.removesuffix(".").splitlines()]
    each[-1] += "." * block.endswith(".")  # not a derivative
    return each[0] if len(each) == 1 else r"\begin{aligned} & " + r" \\ & ".join(each) + r" \end{aligned}"


def tex(line: str) -> str:
    """A line of a formula."""
    line = re.sub(r" +(=|->) +", r" \1 ", re.sub(r"<([^<>=]+,[^<>=]+)>", r"\\langle \1\\rangle{}", line))
    while (start := line.find("sqrt(")) >= 0:
        depth, end = 1, start + 5
        while depth:
            depth += (line[end] == "(") - (line[end] == ")")
            end += 1
        line = rf"{line[:start]}\sqrt{{{line[start + 5 : end - 1]}}}{line[end:]}"
    parts = re.split(r"(\\[a-z]+)", line)
    made = "".join(part if part.startswith("\\") else PART.sub(translated, part) for part in parts)
    return re.sub(r"(?<=[(/])\\;|\\;(?=[ ]*\\;|[,:;/)])", "", made)  # space around words


def translated(found: re.Match) -> str:
    """A name with its points, primes and index, or a sign."""
    if found["name"]:
        name = symbol(found["name"])
        if name.startswith(r"\text") and not found["below"]:
            name = rf"\;{name}\;"
        name = DERIVATIVE[found["early"] or found["late"] or ""].format(name) + found["prime"]
        name += (subscript(found["below"]) if found["below"] else "") + found["more"]
        return name + " " * name[-1].isalpha()
    if found["power"]:
        return r"^{\mathsf{T}}" if found["power"] == "T" else f"^{{{symbol(found['power'])}}}"
    if found["index"]:
        return f"_{{{found['index'][1:]}}}"
    if found["whole"]:
        return r"^{\textstyle\cdot}"
    if found["gap"]:
        return r"\quad " if len(found["gap"]) < 3 else r"\qquad "
    return SIGNS[found["sign"]] if found["sign"] else r" \cdot "


def symbol(name: str) -> str:
    """A letter, Greek or not, a function, a differential, a number, or a word."""
    if name in TEX or (name[0] == "d" and name[1:] in TEX):
        return TEX.get(name) or f"d{TEX[name[1:]]}"
    return rf"\text{{{name}}}" if name.isalpha() and len(name) > 1 + (name[0] == "d") else name


def subscript(below: str) -> str:
    """An index: letters, the name of something, or a formula in braces."""
    inner = below[1:].strip("{}")
    if below.startswith("_{"):
        return f"_{{{tex(inner)}}}"
    return f"_{{{inner if (len(inner) < 3 and inner not in TEX) or ',' in inner else symbol(inner)}}}"


def literal(text: str) -> str:
    """Stars between two characters, powers and products, kept from being read as emphasis; but not in code and formulas."""
    code = re.compile(r"(`[^`]*`|\$\$[^$]*\$\$|\n\n {4}(?:.+\n?)+)")  # indented code begins after an empty line
    return "".join(part if i % 2 else re.sub(r"(?<=[^\s*])\*+(?=[\w(])", stars, part) for i, part in enumerate(code.split(text)))


def stars(found: re.Match) -> str:
    return found[0].replace("*", r"\*")


class Docstrings(Extension):
    """Translates each docstring when its object is read."""

    def on_instance(self, *, obj: Object, **kwargs: Any) -> None:
        if obj.docstring:
            obj.docstring.value = translate(literal(formulas(obj.docstring.value)))
