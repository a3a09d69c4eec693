"""Random problems of discs: what they are, a small sample of them, and that wrong runs and refusals are told."""

from dataclasses import replace

import numpy as np
import pytest

from compare import random_runs as module
from compare.__main__ import main
from compare.random_runs import SIZES, Runs, examine, random_problem
from compare.trust_table import LEAST, MOST, Row
from discs import SimulationError, simulate
from discs.running.failure import NotReached


def row_of(index, *more):
    return Row(*examine([3, index, *(more or (20.0,))]))


@pytest.mark.slow
def test_problems_are_of_all_kinds():
    drawn = [random_problem(3, index) for index in range(60)]
    assert {row.law for _, _, row in drawn} == {"field", "unit", "true", "own"}
    assert {problem.chain.ends for problem, _, _ in drawn} == {"springs", "consistent", "paper", "ring"}
    assert all(SIZES[0] <= problem.chain.n <= SIZES[1] and 1e-8 <= tol <= 1e-2 for problem, tol, _ in drawn)
    again, tol, _ = random_problem(3, 7)
    assert (again.initial.theta == drawn[7][0].initial.theta).all()
    assert tol == drawn[7][1]


@pytest.mark.slow
def test_rods_that_vary_have_loads_too():
    drawn = [random_problem(3, index, True) for index in range(20)]
    kinds = [{type(load).__name__ for load in problem.loads} for problem, _, _ in drawn]
    assert set().union(*kinds) == {"Torque", "Damping", "Slope", "Rest"}
    assert sum(np.ptp(problem.chain.density) > 0 for problem, _, _ in drawn) > 2
    again, _, row = random_problem(3, 7, True)
    assert (again.chain.radius == drawn[7][0].chain.radius).all()
    assert row == drawn[7][2]
    assert all(type(load).__name__ in row.words for load in again.loads)
    assert not random_problem(3, 7)[0].loads


@pytest.mark.slow
@pytest.mark.parametrize("case", [(0,), (3,), (0, 20.0, 1.0)])  # both laws, and loads; chosen for their time only
def test_tolerances_are_kept(case):
    row = row_of(*case)
    assert row.outcome == "within", row
    assert row.reference_error <= row.tol / LEAST
    assert not row.counts or 1 <= row.ratio <= MOST, row


def test_a_tolerance_below_the_rounding_of_sweeps_is_refused_at_once():
    """Few discs hardly see a narrow bump: theta is so small that rounding exceeds its tolerance."""
    problem, tol, _ = random_problem(7, 491)
    with pytest.raises(NotReached, match="so rounding is the limit") as caught:
        simulate(problem, "auto", tol=tol, frames=3, want=("slope",), progress=False)  # not by DOP853
    assert caught.value.best.stats["steps"] < 5000


@pytest.mark.slow
def test_wrong_runs_and_refusals_are_told(monkeypatch):
    true = module.simulate

    def off(problem, method, *args, **options):
        found = true(problem, method, *args, **options)
        return found if method != "auto" else replace(found, x=found.x + 3 * options["tol"] * abs(found.x).max())

    monkeypatch.setattr(module, "simulate", off)
    row = row_of(0)
    assert row.outcome == "ABOVE"
    assert "* above: 3:0" in Runs([row], []).summary()

    def loses(problem, method, *args, **options):
        if method == "auto":
            raise SimulationError("a disc lost its heading", 10, 0.1, 0)
        return true(problem, method, *args, **options)

    monkeypatch.setattr(module, "simulate", loses)
    row = row_of(0)
    assert row.outcome == "refused"
    assert "NOT TRUE" in Runs([row], []).summary()


@pytest.mark.slow
def test_command_line(tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ["trust", "--problems", "1", "--seed", "3", "--seconds", "20", "--quiet", "--out", str(out)]
    assert main(arguments) == 0
    assert sorted(path.name for path in out.iterdir()) == ["trust.csv", "trust.md"]
    assert "| all | 1 | 0 | 0 | 0 | 0 |" in capsys.readouterr().out
