"""Pages that the site makes of what is elsewhere: lessons of notebooks, the gallery of scripts, the reference of packages."""

import ast
import base64
import importlib
import re
from pathlib import Path

import nbformat
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter

ROOT = Path(__file__).parent.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
EXECUTED = ROOT / "out" / "notebooks"  # where `make docs` runs them; without, a lesson has no pictures
GALLERY = sorted((ROOT / "docs" / "gallery").glob("*.py"))
DRAWN = ROOT / "out" / "gallery"  # where `make docs` runs the scripts
KATEX = ROOT / "docs" / "katex"  # draws the formulas in the browser
PACKAGES = ("discs", "continuum", "compare")
WIDGET = "application/vnd.jupyter.widget-view+json"


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the pages into the navigation, where it says `lessons/` and `reference/`."""
    pages = {
        "lessons/": [f"lessons/{path.stem}.md" for path in NOTEBOOKS],
        "reference/": [{package: [{name: f"reference/{name}.md"} for name in modules(package)]} for package in PACKAGES],
    }
    config.nav = [{title: pages.get(to, to) if isinstance(to, str) else to} for entry in config.nav for title, to in entry.items()]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages, the lessons' pictures, and the notebooks themselves."""
    for path in NOTEBOOKS:
        page, pictures = lesson(path)
        files.append(File.generated(config, f"lessons/{path.stem}.md", content=page))
        files.append(File.generated(config, f"lessons/{path.name}", content=path.read_bytes()))
        for name, picture in pictures.items():
            files.append(File.generated(config, f"lessons/{name}", content=picture))
    page, pictures = gallery()
    files.append(File.generated(config, "gallery.md", content=page))
    for name, picture in pictures.items():
        files.append(File.generated(config, f"gallery/{name}", content=picture))
    files.append(File.generated(config, "katex/katex.css", content=with_fonts((KATEX / "katex.min.css").read_text())))
    for name in (name for package in PACKAGES for name in modules(package)):
        files.append(File.generated(config, f"reference/{name}.md", content=reference(name)))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Links to notebooks lead to the pages of the lessons."""
    return re.sub(r"\]\(\.\./notebooks/([\w-]+)\.ipynb\)", r"](lessons/\1.md)", markdown)


def lesson(path: Path) -> tuple[str, dict[str, bytes]]:
    """A notebook as Markdown, executed if it has been; pictures by name."""
    notebook, executed = nbformat.read(path, as_version=4), EXECUTED / path.name
    if executed.exists() and sources(found := nbformat.read(executed, as_version=4)) == sources(notebook):
        notebook = found
    for cell in notebook.cells:
        if cell.cell_type == "code":
            # neither progress bars nor sliders, which need a kernel
            cell.outputs = [out for out in cell.outputs if out.get("name") != "stderr" and WIDGET not in out.get("data", {})]
        else:
            cell.source = re.sub(r"\]\(([\w-]+)\.ipynb\)", r"](\1.md)", cell.source)
            cell.source = re.sub(r"\s*(\$\$.+?\$\$)\s*", r"\n\n\1\n\n", cell.source, flags=re.DOTALL)  # a paragraph of its own
    body, resources = MarkdownExporter().from_notebook_node(notebook, {"output_files_dir": path.stem})
    return f"{body}\n\n[This page as a notebook]({path.name})\n", resources["outputs"]


def gallery() -> tuple[str, dict[str, bytes]]:
    """The page of the short scripts, each with its picture if it has been run; pictures by name."""
    page, pictures = (ROOT / "docs" / "gallery" / "introduction.txt").read_text(encoding="utf-8"), {}
    for path in GALLERY:
        source = path.read_text(encoding="utf-8")
        title, _, words = (ast.get_docstring(ast.parse(source)) or path.stem).partition(": ")
        code = source.split('"""', 2)[2].strip()
        page += f"\n## {title}\n\n{words[:1].upper()}{words[1:]}\n\n```python\n{code}\n```\n"
        for drawn in sorted(DRAWN.glob(f"{path.stem}.*")):
            pictures[drawn.name] = drawn.read_bytes()
            page += f"\n![{title}](gallery/{drawn.name})\n"
    return page, pictures


def with_fonts(css: str) -> str:
    """KaTeX's style sheet with its fonts inside, as some browsers read no fonts from files; without those that are not shipped."""

    def face(found: re.Match[str]) -> str:
        font = KATEX / "fonts" / found[2]
        if not font.exists():
            return ""
        return f"{found[1]}url(data:font/woff2;base64,{base64.b64encode(font.read_bytes()).decode()}) format('woff2')}}"

    return re.sub(r"(@font-face\{[^}]*?src:)url\(fonts/([\w-]+\.woff2)\)[^}]*\}", face, css)


def sources(notebook: nbformat.NotebookNode) -> list[str]:
    return [cell.source for cell in notebook.cells]


def modules(package: str) -> list[str]:
    """Dotted names of a package's modules, itself first; without the command line and what only numba calls."""
    places = [p.relative_to(ROOT).with_suffix("").parts for p in (ROOT / package).rglob("*.py")]
    return sorted({".".join(p).removesuffix(".__init__") for p in places if p[-1] != "__main__" and "kernels" not in p})


def reference(name: str) -> str:
    """The page of a module; that of a package links to what it exports."""
    page = f"::: {name}\n    options:\n      heading_level: 1\n"
    if name not in PACKAGES:
        return page
    module = importlib.import_module(name)
    found = [getattr(module, public) for public in sorted(module.__all__, key=str.lower)]
    links = "\n".join(f"* [`{thing.__name__}`][{thing.__module__}.{thing.__name__}]" for thing in found)
    return f"{page}      members: false\n\n{links}\n"
