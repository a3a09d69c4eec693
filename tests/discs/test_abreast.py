"""Chains side by side in the lanes of a vector: each is what it is alone."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import breathing_ring
from discs import Chain, Gauss6, Midpoint, Radau5, SimulationError, Suzuki4, simulate, simulate_many
from discs.integrators import METHODS
from discs.kernels import abreast, lanes, orders
from discs.kernels.compiled import jit
from discs.kernels.vectors import LANES
from discs.running import abreast as running
from discs.running import step_error
from discs.running.part import Settings, parts_of
from tests.conftest import SLAVED, STEERED, Model, longer, models, uneven
from tests.discs.test_kernels import dense_banded
from tests.discs.test_simulate_many import cloud

pytestmark = pytest.mark.slow  # kernels as plain Python

ROWS = "x", "y", "theta", "omega", "energy"
OWN = *ROWS, "phi", "phi_rate"
ONES = "length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness", "radius"
CLOSE = 3e-12  # as of the twins: what an unconverged sweep of a stiff step leaves


def compare(runs, problems, method, dt, times, close=CLOSE):
    """Runs side by side with those of the plain engine."""
    for i, problem in enumerate(problems):
        run = simulate(problem, method, dt, times, (), False, "plain")
        for name in OWN if hasattr(run, "phi") and run.phi is not None else ROWS:
            one, other = getattr(runs, name)[i], getattr(run, name)
            np.testing.assert_allclose(one, other, atol=close * np.abs(other).max(), rtol=0, err_msg=f"{name} of run {i}, {method}")
        assert runs[i].stats["engine"] == "compiled"
        assert runs[i].stats["step_error"] == pytest.approx(run.stats["step_error"], rel=1e-6, abs=1e-9)
        assert runs[i].stats["steps"] == run.stats["steps"]
        assert runs[i].stats["solves"] >= run.stats["solves"] - 1
        assert runs[i].rolling_residual.max() < 1e-14


@pytest.fixture
def noted(monkeypatch):
    """How many runs were done side by side, by call."""
    counts, original = [], running.side_by_side

    def side_by_side(*arguments):
        found = original(*arguments)
        counts.append(0 if found is None else int(found.done.sum()))
        return found

    for where in ("part", "searches"):
        monkeypatch.setattr(f"discs.running.{where}.side_by_side", side_by_side)
    return counts


@models(SLAVED + STEERED, [SLAVED[0], SLAVED[3], SLAVED[6], *STEERED])
@pytest.mark.parametrize("name", ["midpoint", "suzuki4", "gauss6", "radau5"])
def test_side_by_side_is_one_by_one(model, name, kernels_as_python, noted):
    """Ten chains that differ in everything, in two bundles; converged, and after one sweep, where the matrix matters."""
    problems, once = cloud(10, 9, model), {"sweeps": 1, "tolerance": 0}
    for method in (METHODS[name](), Suzuki4(Midpoint(**once)) if name == "suzuki4" else METHODS[name](**once)):
        if method.sweep_tolerance == 0 and name not in ("midpoint", "suzuki4"):
            continue  # a step of collocation that is not swept loses energy
        runs = simulate_many(problems, method, 0.01, [0.0, 0.02, 0.035], threads=1, progress=False)
        compare(runs, problems, method, 0.01, [0.0, 0.02, 0.035])
        assert noted.pop() == 10


@pytest.mark.parametrize("n", [3, 4, 5, 6, 8, 17])
def test_few_discs(n, kernels_as_python, noted):
    for model in SLAVED + STEERED:
        if n >= {"springs": 3, "paper": 3, "consistent": 4, "ring": 5}[model.ends]:
            problems = cloud(3, n, model)
            runs = simulate_many(problems, "midpoint", 0.002, [0.003, 0.008], progress=False)
            compare(runs, problems, "midpoint", 0.002, [0.003, 0.008])
            assert noted == ([3] if model.ends != "consistent" or n >= running.LEAST["consistent"] else [])
            noted.clear()


def test_compiled():
    problems = cloud(11, 33)
    runs = simulate_many(problems, "midpoint", 0.01, [0.0, 0.02, 0.035], progress=False)
    compare(runs, problems, "midpoint", 0.01, [0.0, 0.02, 0.035])
    again = simulate_many(problems[:8], "midpoint", 0.01, [0.0, 0.02, 0.035], threads=1, progress=False)
    np.testing.assert_array_equal(again.x, runs.x[:8])
    assert [block.runs for block in runs._blocks] == [list(range(11))]


def test_what_needs_a_word_is_left_to_simulate(kernels_as_python, noted, monkeypatch):
    """Steps that do not converge: warnings are those of `simulate`, of the chains that have them."""
    monkeypatch.setattr(step_error, "HALVINGS", 2)
    problems, method = cloud(11, 7, Model("ring", "field")), Midpoint(sweeps=12)
    problems[3] = replace(problems[3], chain=replace(problems[3].chain, bending_stiffness=1e6, torsion_stiffness=1e6))
    with pytest.warns(UserWarning, match=r"^1 of 11 runs have warnings, as run 3: midpoint: 2 of 2 steps did not converge"):
        runs = simulate_many(problems, method, 0.01, [0.02], progress=False)
    assert noted == [3]
    with pytest.warns(UserWarning, match="may not be trusted") as warned:
        alone = simulate(problems[3], method, 0.01, [0.02], progress=False)
    assert runs.warned == {3: [str(one.message) for one in warned]}
    np.testing.assert_array_equal(runs[3].x, alone.x)
    rest = [i for i in range(11) if i != 3]
    for i in rest:
        np.testing.assert_allclose(runs.x[i], simulate(problems[i], method, 0.01, [0.02], progress=False).x, rtol=1e-11)


def test_a_lost_heading_is_left_to_simulate(kernels_as_python, noted):
    """One of eight rings collapses before the others."""
    problems = [lump(breathing_ring("unit", duration=4.0, omega=1.5 if i == 5 else 0.1), 8) for i in range(8)]
    times = [0.9]
    with pytest.warns(UserWarning, match="1 of 8 runs failed, as run 5: a disc lost its heading"):
        runs = simulate_many(problems, "midpoint", 0.1, times, progress=False)
    with pytest.raises(SimulationError, match="lost its heading") as caught:
        simulate(problems[5], "midpoint", 0.1, times, progress=False)
    assert str(runs.failed[5]) == str(caught.value)
    assert noted == [0]
    assert np.isnan(runs.x[5]).all()
    np.testing.assert_array_equal(runs.x[4], simulate(problems[4], "midpoint", 0.1, times, progress=False).x)


def test_a_long_step_is_compared_as_in_one_run(kernels_as_python, noted, monkeypatch):
    """With its two halves: the estimates are those of `simulate`, which runs with more than 2 % are left to."""
    monkeypatch.setattr(step_error, "DOUBTFUL", 2e-3)
    problems = cloud(8, 9)
    runs = simulate_many(problems, "midpoint", 0.025, [0.3], progress=False)
    assert noted[0] == 8
    compared = []
    for i, problem in enumerate(problems):
        run = simulate(problem, "midpoint", 0.025, [0.3], (), False, "plain")
        assert runs[i].stats["step_error"] == pytest.approx(run.stats["step_error"], rel=1e-6)
        compared.append(run.stats["step_error"])
    assert 0.001 < max(compared) < 0.02


@pytest.mark.parametrize("how", [{"tol": 3e-4, "method": "midpoint"}, {"tol": {"omega": 1e-5}}], ids=["midpoint", "auto"])
def test_each_run_keeps_its_tolerance(how, kernels_as_python, noted):
    """Each has a search of its own; searches ask for few different steps, so that runs go side by side."""
    problems = cloud(6, 6)
    problems[4] = replace(problems[4], initial=replace(problems[4].initial, omega=3 * problems[4].initial.omega))
    runs = simulate_many(problems, frames=[0.3, 0.9], progress=False, **how)
    assert noted[0] == 6
    assert sum(noted) >= 11
    for run, problem in zip(runs, problems, strict=True):
        exact = simulate(problem, "gauss8", 0.02, [0.3, 0.9], (), False, "plain")
        alone = simulate(problem, frames=[0.3, 0.9], want=("slope",), progress=False, **how)  # not by DOP853
        bound = how["tol"] if isinstance(how["tol"], dict) else dict.fromkeys(("x", "y", "theta"), how["tol"])
        for name, tol in bound.items():
            size = np.abs(getattr(exact, name)).max()
            assert np.abs(getattr(run, name) - getattr(exact, name)).max() <= run.error_estimate[name] <= tol * size
        assert run.stats["tol"] == how["tol"]
        assert abs(run.stats["attempts"] - alone.stats["attempts"]) <= 2
        assert 0.5 < alone.stats["dt"] / run.stats["dt"] < 2  # alone the first number of steps is guessed from the chain


@pytest.mark.long  # compiles for 20 s
def test_compiled_own_headings():
    for model in STEERED:
        problems = cloud(11, 17, model)
        runs = simulate_many(problems, "midpoint", 0.01, [0.0, 0.02, 0.035], progress=False)
        compare(runs, problems, "midpoint", 0.01, [0.0, 0.02, 0.035])


def test_a_heading_that_turns_far_in_a_step_is_compared(kernels_as_python, noted):
    """Whole turns do not show in third differences: a chain that spins has its steps compared, as alone."""
    problems = cloud(3, 7, STEERED[0])
    start = problems[1].initial
    still = replace(start, omega=0 * start.omega, phi_rate=314 + 0 * start.omega)
    problems[1] = replace(problems[1], initial=still)
    with pytest.warns(UserWarning, match="1 of 3 runs have warnings, as run 1"):
        runs = simulate_many(problems, "midpoint", 0.02, [0.3], progress=False)
    with pytest.warns(UserWarning, match="too long for this motion") as warned:
        simulate(problems[1], "midpoint", 0.02, [0.3], (), False, "plain")
    assert runs.warned == {1: [str(one.message) for one in warned]}
    assert noted == [2]


def test_calls_of_few_steps_make_the_same_bits(kernels_as_python, monkeypatch):
    """As `simulate`, whose calls are cut too: frames and looks go on."""
    problems = cloud(8, 9)
    whole = simulate_many(problems, "midpoint", 0.01, [0.0, 0.02, 0.055, 0.06], progress=False)
    monkeypatch.setattr(running, "CHUNK", 9 * LANES)
    parts = simulate_many(problems, "midpoint", 0.01, [0.0, 0.02, 0.055, 0.06], progress=False)
    for name in ROWS:
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))
    assert whole[3].stats["step_error"] == parts[3].stats["step_error"]


def test_the_initial_state_is_that_of_a_problem():
    for model in SLAVED + STEERED:
        problems = cloud(5, 9, model)
        found = running.InitialStates([problems[2], *problems])
        for i, problem in enumerate(problems, 1):
            np.testing.assert_allclose(found.momenta[i], np.atleast_2d(problem.start().pi), rtol=4e-16)
            assert found.energy[i] == pytest.approx(problem.energy(), rel=1e-14)
            assert found.bounds[i] == pytest.approx(problem.blown_up, rel=1e-14)
        assert len(found.parameters) == 5


def test_which_runs_go_side_by_side():
    alike = [*cloud(4, 9), *cloud(4, 9, Model("springs", "unit"))]
    true = replace(alike[0], chain=Chain(**dict.fromkeys(ONES, 1.0), n=9, rolling="unit", curvature="true", stretch_stiffness=1.0))
    quadratic = uneven(9, STEERED[0])
    quadratic = replace(quadratic, chain=replace(quadratic.chain, degree=2))
    others = [quadratic, true, cloud(1, 8)[0], replace(alike[0], duration=2.0)]
    given = Settings(Midpoint(), 0.1, None, 1, (), "compiled")

    def parts(settings, problems):
        return [part.numbers for part in parts_of(problems, settings)]

    assert parts(given, [*alike, *others]) == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    assert parts(given, [*alike, *cloud(4, 9, STEERED[0])]) == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    for other in (given._replace(method=METHODS["rk4"]()), given._replace(engine="plain"), given._replace(want=("slope",))):
        assert parts(other, alike) == [list(range(8))]
    assert (
        parts(given._replace(method=None), alike) == parts(given._replace(method=Radau5()), alike) == [[0, 1, 2, 3], [4, 5, 6, 7]]
    )
    assert parts(given._replace(method=None, dt=None), alike) == [[0, 1, 2, 3], [4, 5, 6, 7]]  # to a tolerance
    assert parts(given._replace(dt=None, method=Gauss6()), alike) == [[0, 1, 2, 3], [4, 5, 6, 7]]  # suggested steps
    assert parts(given._replace(dt=None, tol=1e-3, method="auto"), alike) == [[0, 1, 2, 3], [4, 5, 6, 7]]
    many = [alike[0]] * 700
    assert [len(numbers) for numbers in parts(given, many)] == [256, 256, 188]


@pytest.mark.parametrize("kind", [float, longer(complex)])
def test_elimination_abreast(kind):
    """Each lane on its own."""

    def solve(order, ring, ghosts, m, b):
        orders.factor(order, ring, ghosts, m)
        orders.solve(order, ring, ghosts, m, b)

    compiled, rng = jit(solve), np.random.default_rng(4)
    for ring, ghosts, sizes in ((False, False, (2, 3, 9)), (False, True, (8, 9)), (True, False, (5, 6, 9))):
        for n in sizes:
            order = abreast.Abreast(n, n, 0, ring)
            m = orders.pick(orders.matrices(order, kind(1), 1), 0)
            entries = rng.standard_normal((4, n, LANES)) + (1j * rng.standard_normal((4, n, LANES)) if kind is complex else 0)
            a, u, w, right = entries
            a += 12
            if not ring:
                u[n - 1], w[n - 2 :] = 0.0, 0.0
            corner = rng.standard_normal((2, LANES)) * ghosts
            b = right.reshape(-1).copy()
            for to, values in ((m.a, a), (m.u, u), (m.w, w), (m.corner, corner)):
                to[:] = values.reshape(-1)
            (solve if n == 9 else compiled)(order, ring, ghosts, m, b)
            for lane in range(LANES):
                matrix = dense_banded(a[:, lane], u[:, lane], w[:, lane], corner[:, lane])
                if ring:
                    for i, j, value in ((n - 1, 0, u[-1, lane]), (n - 2, 0, w[-2, lane]), (n - 1, 1, w[-1, lane])):
                        matrix[i, j] += value
                        matrix[j, i] += value
                expected = np.linalg.solve(matrix, right[:, lane])
                np.testing.assert_allclose(b.reshape(n, LANES)[:, lane], expected, atol=1e-14, err_msg=f"{n}, {ring}, {ghosts}")
    assert lanes.HALO == 2 * LANES
