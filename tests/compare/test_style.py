"""One colour and mark for one method in all pictures."""

import numpy as np
import pytest

from compare import figures, lump
from compare.entrants import ours, peers
from compare.hardcases.runs import OURS
from compare.work_precision import Row, WorkPrecision
from continuum import untwisting_rod
from discs.pictures.style import METHOD, PEER, look


def test_each_method_has_a_line_of_its_own():
    lines = [*METHOD.values(), *PEER.values()]
    assert len(set(METHOD.values())) == len(METHOD)
    assert len({line for line in lines if line != PEER["Exudyn, generic"]}) == len(lines) - 2  # Exudyn's two are never together
    assert set(METHOD) >= set(OURS)


@pytest.mark.long  # peers are slow to import
@pytest.mark.parametrize("law", ["field", "unit"])
def test_no_method_that_is_compared_is_without_one(law):
    problem = lump(untwisting_rod(law), n=8)
    assert {method.name for method in ours(problem)} <= set(METHOD)
    assert {peer.name for peer in peers(problem)} <= set(PEER)


def test_what_else_is_drawn_leaves_a_line_as_it_is():
    rows = {name: Row("field", 8, name, name in METHOD, 1.0, 1e-3, 1.0) for name in ("SciPy RK45", "SciPy BDF", "gauss6")}
    alone, together = (
        {line.get_color() for line in figures.precision(WorkPrecision([rows[name] for name in names], {}, {}))[0].lines}
        for names in (("SciPy BDF",), rows)
    )
    assert alone == {look("SciPy BDF")["color"]}
    assert alone < together
    assert look("gauss6")["zorder"] > look("SciPy BDF")["zorder"]
    assert np.isclose(look("a peer of yours")["linewidth"], look("SciPy BDF")["linewidth"])


def test_a_method_of_ones_own_is_drawn_too():
    study = WorkPrecision([Row("field", 8, name, True, 1.0, 1e-3, 1.0) for name in ("mine", "gauss6")], {}, {})
    legend = figures.precision(study)[0].figure.legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["gauss6", "mine"]
