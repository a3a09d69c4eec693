"""A page of results: paragraphs, tables and pictures, in Markdown and as HTML that contains its pictures."""

import base64
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

from markdown_it import MarkdownIt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compare.tables import write_csv

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
body {{ font: 16px/1.5 sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }}
img {{ max-width: 100%; }}
table {{ border-collapse: collapse; display: block; overflow-x: auto; font-size: 0.8rem; margin: 1rem 0; }}
th, td {{ border: 1px solid #ccc; padding: 0.2rem 0.5rem; text-align: left; white-space: nowrap; }}
table:has(th:nth-child(12)) {{ width: max-content; max-width: 96vw; font-size: 0.65rem;
  position: relative; left: 50%; transform: translateX(-50%); }}
table:has(th:nth-child(12)) :is(th, td) {{ padding: 0.1rem 0.25rem; }}
strong {{ color: #b00; }}
h1 strong, h2 strong {{ color: inherit; }}
</style>
</head>
<body>
{body}
</body>
</html>
"""


@dataclass
class Page:
    """A page in Markdown, with its pictures and their data as files beside it.

    folder : for the files. parts : paragraphs.
    """

    folder: Path
    parts: list[str] = field(default_factory=list)

    def add(self, *paragraphs: str) -> None:
        """Paragraphs, headings or tables, in Markdown."""
        self.parts += paragraphs

    def figure(
        self, name: str, drawn: Axes | Figure, caption: str, columns: Sequence[str], rows: Iterable[Sequence[object]]
    ) -> None:
        """A picture report_name.png, and what it shows as report_name.csv."""
        name = f"report_{name}"
        picture = drawn if isinstance(drawn, Figure) else drawn.figure
        picture.savefig(self.folder / f"{name}.png", dpi=110)  # type: ignore[union-attr]
        write_csv(self.folder / f"{name}.csv", chain([columns], rows))
        self.add(f"![{caption}]({name}.png)", f"{caption} Data: [{name}.csv]({name}.csv).")

    def picture(self, name: str, caption: str, *data: str) -> None:
        """A picture that is in the folder, with its caption and links to files of its data."""
        links = ", ".join(f"[{file}]({file})" for file in data)
        self.add(f"![{caption}]({name})", f"{caption} Data: {links}." if data else caption)

    def markdown(self) -> str:
        """The page; its pictures are the files beside it."""
        return "\n\n".join(self.parts) + "\n"

    def html(self, title: str) -> str:
        """The page with its pictures inside."""

        def inlined(match: re.Match[str]) -> str:
            return f'src="data:image/png;base64,{base64.b64encode((self.folder / match[1]).read_bytes()).decode()}"'

        body = MarkdownIt("commonmark", {"html": False}).enable("table").render(self.markdown())
        return PAGE.format(title=title, body=re.sub(r'src="([^":]+\.png)"', inlined, body))
