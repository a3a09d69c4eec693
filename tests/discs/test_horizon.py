"""The horizon of a run against dispersion relations, differences of runs, and what theory says of regular motions."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from discs import simulate
from discs.analysis import growth, horizon, lyapunov
from discs.chains.twist import untwisting_chain
from discs.loads import Custom
from tests.conftest import Model, uneven
from tests.discs.test_modes import ring, waves

pytestmark = pytest.mark.slow  # steps with sparse factors


def test_errors_grow_at_the_rate_of_the_dispersion_relation():
    """Late: of a straight ring that rolls by the field law, by the fastest wave; so each digit takes ln 10/sigma."""
    problem = replace(ring(5, "field", 1.2), duration=30.0)
    fastest = waves(5, "field", 1.2).real.max()
    found = growth(problem, 0.1, "midpoint")
    late = found.t > 20.0
    slope = np.polyfit(found.t[late], np.log(found.growth[late]), 1)[0]
    assert slope == pytest.approx(fastest, rel=1e-3)
    assert found.horizon(1e-6) - found.horizon(1e-4) == pytest.approx(np.log(100) / fastest, abs=0.2)  # two steps


@pytest.mark.parametrize(
    ("model", "n"),
    [
        (Model("consistent", "field"), 7),
        (Model("ring", "unit"), 7),
        (Model("springs", "steered"), 7),
        (Model("springs", "field"), 3),
        (Model("springs", "steered"), 2),
    ],
    ids=str,
)
def test_growth_is_that_of_differences_of_runs(model, n):
    """The largest of all errors in the first four waves of each coordinate, by runs that start at two sides of the first."""
    problem = replace(uneven(n, model), duration=1.0)
    rows, s = problem.system.rows, (np.arange(n) + 0.5) / n
    found = growth(problem, 0.05)
    if model.ends == "ring":
        at = 2 * np.pi * np.arange(7) / 7
        several = np.array([0 * at + 1, np.cos(at), np.sin(at), np.cos(2 * at)])
    else:
        several = np.cos(np.pi * np.arange(4)[:, None] * s)
    shapes, scale, size = np.linalg.qr(several.T)[0].T, dict(zip(rows, problem.system.scale, strict=True)), 1e-5
    columns = []
    for row in rows:
        for shape in shapes:
            ends = []
            for sign in (-1, 1):
                place = getattr(problem.initial, row) + sign * size * scale[row] * shape
                # momenta stay as they are: so omega changes where the inertia does
                changed = replace(problem.initial, **{row: place})
                changed = _with_momenta(problem, changed)
                run = simulate(replace(problem, initial=changed), "gauss4", 0.05, 2, progress=False, engine="plain")
                ends.append(np.concatenate([getattr(run, name)[-1] / scale[name] for name in rows]))
            columns.append((ends[1] - ends[0]) / (2 * size))
    assert found.growth[-1] == pytest.approx(np.linalg.norm(np.array(columns), 2), rel=1e-6)
    assert found.growth[-1] > 1.2


def _with_momenta(problem, state):
    """A state with the momenta of the problem's initial one."""
    system, z = problem.system, problem.start()
    q = np.array([getattr(state, name) for name in system.rows])
    v = system.forward(system.basis(system.shape(q)), z.pi)
    return replace(state, omega=v[2], **({"phi_rate": v[3]} if len(v) == 4 else {}))


def test_growth_has_a_limit_for_many_discs():
    """As errors are waves along the rod: the paper's motion, ends that converge like 1/n^2."""
    found = [growth(untwisting_chain(n, "unit", "consistent", duration=3.0), 0.1, "midpoint") for n in (9, 17, 33)]
    first, second = (np.abs(few.growth / many.growth - 1).max() for few, many in pairwise(found))
    assert second < first / 2.5
    assert second < 0.1
    assert found[2].horizon(1e-2) == np.inf  # later than the duration


def test_both_horizons_tell_of_the_same_growth():
    """The worst error is lost first; each further digit lasts as long in both, ln 10/sigma."""
    problem = replace(ring(5, "field", 1.2), duration=24.0)
    fastest = waves(5, "field", 1.2).real.max()
    worst, one = growth(problem, 0.2, "midpoint"), lyapunov(problem, 1, 0.2, "midpoint", every=2)
    assert worst.horizon(1e-8, 1e-2) < one.horizon(1e-8, 1e-2)
    for found in (worst, one):
        assert found.horizon(1e-8, 1e-2) == found.horizon(1e-6, 1.0) > found.horizon(1e-7, 1e-2)
        assert found.horizon(1e-8, 1e-2) - found.horizon(1e-8, 1e-3) == pytest.approx(np.log(10) / fastest, abs=0.4)  # an interval


def test_the_computation_ends_at_the_horizon():
    times = []

    def force(t, q, v):
        times.append(t)
        return 0 * q

    problem = replace(ring(5, "field", 2.0), duration=400.0, loads=(Custom(force),))
    at = horizon(problem, 1e-3, 0.1, "midpoint")
    assert at == pytest.approx(times[-1], abs=0.1)
    assert at < 20.0


def test_bad_input():
    problem = untwisting_chain(5)
    with pytest.raises(ValueError, match="growth is that of a Problem"):
        horizon(problem.chain, 1e-3)
    for wrong in (0.0, -1.0, np.nan, "small"):
        with pytest.raises(ValueError, match="error must be"):
            horizon(problem, wrong)
        with pytest.raises(ValueError, match="tolerance must be"):
            horizon(problem, 1e-3, tolerance=wrong)
    with pytest.raises(ValueError, match="dt must be"):
        growth(problem, -0.1)
    with pytest.raises(ValueError, match="most must be"):
        growth(problem, most=0.0)
    with pytest.raises(ValueError, match=r"method \(with tangents\) must be one of .*got 'rk4'"):
        growth(problem, method="rk4")
