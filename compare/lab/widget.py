"""The lab in a notebook: the same page as a widget, by anywidget, which needs no server."""

from typing import Any

import anywidget

from compare.lab import page
from compare.lab.beside import Fields
from compare.lab.engine import Engines
from compare.lab.session import Session
from compare.lab.settings import Settings
from discs import Solution

SHARED: list[tuple[Fields, Engines]] = []  # of all widgets of a notebook


class LabWidget(anywidget.AnyWidget):
    """The lab in a cell. `run` is what the discs did so far.

    A widget has one session for all its views: two views of one cell show the same discs.
    """

    _esm = page.module()
    _css = page.style()

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        if not SHARED:
            SHARED.append((Fields(), Engines()))
        self.session = Session(settings, *SHARED[0])
        self.on_msg(self._answer)

    @property
    def run(self) -> Solution:
        """The run so far: the frames that are kept."""
        run: Solution = self.session.run
        return run

    def _answer(self, widget: Any, content: Any, buffers: Any) -> None:
        """Answer a message of the page."""
        for reply in self.session.opening() if content == {"kind": "open"} else self.session.handle(content):
            self.send(reply.content, [reply.data] if reply.data else None)
