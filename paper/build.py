"""The paper as a PDF, by pandoc and typst: `make paper` writes it to out/paper. The journal builds its own from the same files."""

import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
WORDS = 750, 1750  # what the Journal of Open Source Software asks for
PAGE = "papersize: a4\nfontsize: 10pt\nmargin: {x: 2.5cm, y: 2.5cm}"
SECTIONS = (
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "Research impact statement",
    "AI usage disclosure",
    "Acknowledgements",
    "References",
)


def check(text: str, bibliography: str) -> None:
    """Length, sections and citations.

    Raises
    ------
    ValueError : for a paper that is too short or too long, lacks a section, or cites something else than what is in paper.bib.
    """
    body = text.split("---", 2)[2]
    words, headings = len(body.split()), re.findall(r"^# (.+)$", body, re.MULTILINE)
    if not WORDS[0] <= words <= WORDS[1]:
        raise ValueError(f"the paper must have {WORDS[0]} to {WORDS[1]} words; it has {words}")
    if lacking := [name for name in SECTIONS if name not in headings]:
        raise ValueError(f"the paper lacks the sections {', '.join(lacking)}")
    cited, keys = set(re.findall(r"@(\w+)", body)), set(re.findall(r"^@\w+\{(\w+)", bibliography, re.MULTILINE))
    if cited != keys:
        raise ValueError(
            f"cited, but not in paper.bib: {sorted(cited - keys)}; in paper.bib, but not cited: {sorted(keys - cited)}"
        )


def main(out: Path) -> None:
    """Check and build."""
    import pypandoc  # here, as the check needs neither
    import typst

    text = (HERE / "paper.md").read_text(encoding="utf-8")
    check(text, (HERE / "paper.bib").read_text(encoding="utf-8"))
    names = dict(re.findall(r"- name: (.+)\n    index: (\d+)", text))
    text = text.replace("](../", f"]({HERE.parent.as_posix()}/")
    text = text.replace("\nauthors:", "\nauthor:").replace("\nbibliography:", f"\n{PAGE}\nbibliography:")
    for name, index in names.items():  # pandoc's template has no list of affiliations
        text = text.replace(f"    affiliation: {index}\n", f"    affiliation: {name}\n")
    options = [
        "--standalone",
        "--citeproc",
        f"--resource-path={HERE}",
        f"--bibliography={HERE / 'paper.bib'}",
        "--metadata=link-citations:true",
    ]
    out.mkdir(parents=True, exist_ok=True)
    source = out / "paper.typ"
    source.write_text(pypandoc.convert_text(text, "typst", "markdown", options), encoding="utf-8")
    typst.compile(source, output=out / "paper.pdf", root="/")
    typst.compile(source, output=out / "paper-{p}.png", root="/", format="png", ppi=90.0)
    print(f"written to {out}: paper.pdf, and its pages as pictures")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/paper"))
