"""The cross-checks that need no package beyond those of the project, and a control that must fail."""

import numpy as np
import pytest

from compare.__main__ import main
from compare.crosschecks import table
from compare.crosschecks.both import compared, start
from compare.crosschecks.in_scipy import saddle
from compare.crosschecks.in_sympy import at_the_end, kane, lagrange, rows, solved
from compare.crosschecks.stated import Stated
from discs import simulate


@pytest.mark.slow
def test_sympys_own_equations_give_our_motion_and_multipliers():
    own, field = rows((Stated("own", 2, duration=1.5), Stated("field", 3, duration=1.5)))[::2]  # those of Lagrange
    assert "multipliers" in own.quantity
    # DOP853 to 1e-13 a step, multipliers of the size of 1
    assert max(own.difference, field.difference) < 2e-11


@pytest.mark.slow
def test_kanes_and_lagranges_methods_agree_and_notice_a_wrong_spring():
    stated = Stated("unit", 3, duration=1.5)
    y = at_the_end(stated, kane(stated))
    assert compared(stated, y[:9].reshape(3, 3))["difference"] < 2e-11
    accelerations = solved(lagrange(stated), y)[:18]
    np.testing.assert_allclose(accelerations, solved(kane(stated), y), atol=1e-11)
    stated.parameters["torsion_stiffness"][0] *= 1.001
    assert np.abs(accelerations - solved(kane(stated), y)).max() > 1e-5


@pytest.mark.parametrize(("law", "n"), [("field", 4), ("unit", 5), ("own", 3)])
def test_the_saddle_point_of_the_statement_gives_our_forces(law, n):
    """At the start, where both have the same positions and velocities."""
    stated = Stated(law, n)
    y = start(stated)
    run = simulate(stated.problem(), "rk4", dt=0.01, frames=[0.0, 0.01], want=("velocity", "contact_force"), progress=False)
    size = stated.q0.size
    np.testing.assert_allclose(np.stack([run.x_rate[0], run.y_rate[0]]).ravel(), y[size : size + 2 * n], atol=1e-13)
    np.testing.assert_allclose(run.contact_force[0], saddle(stated)(y[:size], y[size:])[1], atol=1e-11)


def test_order_is_the_slope():
    assert table.order([0.1, 0.2, 0.4], [3e-4, 2.4e-3, 1.92e-2]) == pytest.approx(3)


def test_a_peer_that_is_not_installed_has_a_row(monkeypatch, tmp_path):
    monkeypatch.setitem(table.PEERS, "in_casadi", ("CasADi", "no_such_package", "casadi"))
    (row,) = table.crosscheck(tmp_path, ("in_casadi",), progress=False)
    assert row.problem == "not installed: pip install casadi"
    assert "| CasADi | not installed: pip install casadi |" in (tmp_path / "crosschecks.md").read_text()
    assert (tmp_path / "crosschecks.csv").read_text().startswith("peer,problem,quantity,ours,theirs,difference,order,")


def test_an_unknown_peer_is_refused(capsys):
    with pytest.raises(SystemExit):
        main(["crosscheck", "--peers", "Adams"])
    assert "invalid choice: 'Adams'" in capsys.readouterr().err
