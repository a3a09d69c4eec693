"""The lab in a notebook: a widget with the module of the page, and a session behind it."""

import sys

import numpy as np
import pytest

from compare import lab
from compare.lab import page
from continuum import untwisting_rod

pytest.importorskip("anywidget", reason="needs anywidget, of the extra lab")
pytest.importorskip("compare.lab.widget")


@pytest.fixture
def widget(monkeypatch):
    """A widget, and what it sent."""
    monkeypatch.setattr(sys.modules["compare.lab.widget"], "SHARED", [(None, None)])  # no other processes
    made = lab(untwisting_rod(radius=0.7), n=9)
    sent = []
    monkeypatch.setattr(made, "send", lambda content, buffers=None: sent.append((content, buffers)))
    return made, sent


def test_answers_as_the_server_does(widget):
    made, sent = widget
    made._answer(made, {"kind": "open"}, [])
    assert [content["kind"] for content, _ in sent] == ["scene", "frame"]
    content, (data,) = sent[1]
    rows = np.frombuffer(data, "<f4").reshape(len(content["rows"]), 9)
    np.testing.assert_allclose(rows[content["rows"].index("theta")], made.session.moment.theta, atol=1e-6)
    made._answer(made, {"kind": "step", "by": "forward"}, [])
    made._answer(made, {"kind": "exec"}, [])
    assert [content["kind"] for content, _ in sent[2:]] == ["frame", "refused", "scene", "frame"]
    assert made.run.t.tolist() == [0.0, 0.01]


def test_has_the_module_of_the_page(widget):
    made, _ = widget
    assert made._esm == page.module()
    assert made._css == page.style()


def test_other_things_than_scenes_are_refused():
    with pytest.raises(ValueError, match=r"lab takes a Scene, such as untwisting_rod\(\); got 3"):
        lab(3)
    with pytest.raises(ValueError, match="must be a whole number of at least 3"):
        lab(n=2)
