"""Pages that the site makes of what is elsewhere: lessons of the notebooks, the reference of the packages."""

import importlib
import re
from pathlib import Path

import nbformat
from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter

ROOT = Path(__file__).parent.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
EXECUTED = ROOT / "out" / "notebooks"  # where `make docs` runs them; without, a lesson has no pictures
PACKAGES = ("discs", "continuum", "compare")


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
    for name in (name for package in PACKAGES for name in modules(package)):
        files.append(File.generated(config, f"reference/{name}.md", content=reference(name)))
    return files


def lesson(path: Path) -> tuple[str, dict[str, bytes]]:
    """A notebook as Markdown, executed if it has been, with formulas as MathML, which needs no script; pictures by name."""
    notebook, executed = nbformat.read(path, as_version=4), EXECUTED / path.name
    if executed.exists() and sources(found := nbformat.read(executed, as_version=4)) == sources(notebook):
        notebook = found
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs = [out for out in cell.outputs if out.get("name") != "stderr"]  # progress bars
        else:
            cell.source = re.sub(r"\$\$(.+?)\$\$", lambda m: convert(m[1], display="block"), cell.source, flags=re.DOTALL)
            cell.source = re.sub(r"\]\(([\w-]+)\.ipynb\)", r"](\1.md)", cell.source)
            # in a span: Markdown would take a line that begins with <math> for a block
            cell.source = re.sub(r"\$(.+?)\$", lambda m: f"<span>{convert(m[1])}</span>", cell.source)
    body, resources = MarkdownExporter().from_notebook_node(notebook, {"output_files_dir": path.stem})
    return f"{body}\n\n[This page as a notebook]({path.name})\n", resources["outputs"]


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
