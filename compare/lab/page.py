"""The page of the lab: one ES module for browser and notebook, made of the files in `data` and in `discs.pictures.data`."""

from functools import cache
from importlib.resources import files


def _file(package: str, *parts: str) -> str:
    return files(package).joinpath(*parts).read_text(encoding="utf-8")


@cache
def module() -> str:
    """The ES module: three.js, the drawing code of `run.view`, and the page; its default export has `render({model, el})`."""
    parts = _file("discs", "pictures", "data", "three.min.js"), _file("discs", "pictures", "data", "stage.js")
    return "\n".join([*parts, _file("compare", "lab", "data", "lab.js")])


@cache
def style() -> str:
    """The style sheet."""
    return _file("compare", "lab", "data", "lab.css")


@cache
def html() -> str:
    """The page."""
    return _file("compare", "lab", "data", "lab.html")


@cache
def socket() -> str:
    """The script of the page: it joins the module to a WebSocket."""
    return _file("compare", "lab", "data", "socket.js")
